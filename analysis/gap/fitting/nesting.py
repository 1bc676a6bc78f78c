"""What a verdict rests on: one row per hypothesis, in numbers that can be kept and read again.

The excess is chi^2 beyond the noise, per sample of one joint, with what the numbers cost.  Nothing
here depends on the calibration, so a table of many robots can be weighed anew in no time; which
pairs were fitted at all does, where a further cause is futile under the stored one.
"""

import numpy as np

IDLE = 0.02  # share of the size that makes itself felt, below which a number does nothing,
TOLD = 10.0  # unless it is more than these standard deviations from zero
FAR = 3.0  # squared gap over its floor, less one: more contradicts a small excess


def simpler_names(fit):
    """Names that a fit really holds, if a cause has shrunk to a simpler one; else None."""
    names = [_shrunk_name(fit, member) for member in fit.hypothesis.members]
    own = [member.cause.name for member in fit.hypothesis.members]
    return None if names == own else tuple(sorted(set(names)))


def repeats_simulator(fit):
    """Whether a cause is no more than another number of an effect that the simulator holds."""
    held = {member.cause.name for member in fit.hypothesis.problem.inside}
    return any({_shrunk_name(fit, member), _even_name(fit, member)} & held
               for member in fit.hypothesis.members)


def _shrunk_name(fit, member):
    name, number = member.cause.without or (None, None)
    if name is None:
        return member.cause.name
    joints, key = list(member.joints), f"{member.name}.{number}"
    told = [min((doubt for entry, doubt in zip(fit.hypothesis.open, fit.spread)
                 if entry.key == key and entry.joint in (None, k)), default=np.inf)
            for k in joints]
    little = np.minimum(IDLE * np.abs(np.asarray(member.sizes[number])[..., joints]),
                        TOLD * np.array(told))
    shrunk = np.all(np.abs(_value(fit, member, number)) < little)
    return name if shrunk else member.cause.name


def _even_name(fit, member):
    """As `_shrunk_name`, where two numbers are alike: an offset of the drive can hide that."""
    name, *pair = member.cause.even or (None,)
    if name is None:
        return member.cause.name
    one, other = (_value(fit, member, number) for number in pair)
    return name if np.all(np.abs(one - other) <= IDLE * np.abs(one + other)) else member.cause.name


def _value(fit, member, number):
    return fit.hypothesis.values[f"{member.name}.{number}"][..., list(member.joints)]
