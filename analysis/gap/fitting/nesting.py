"""Causes that contain each other: what a fitted cause is once a parameter has shrunk to zero."""

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, held_members
from clie_blocks.analysis.gap.method.method import Method


def simpler_names(fit: Fit, method: Method) -> tuple[str, ...] | None:
    """Names that a fit really holds, if a cause has shrunk to a simpler one; else None."""
    names = [shrunk_name(fit, member, method) for member in fit.hypothesis.members]
    own = [member.cause.name for member in fit.hypothesis.members]
    return None if names == own else tuple(sorted(set(names)))


def repeats_simulator(fit: Fit, method: Method) -> bool:
    """Whether a cause only changes a parameter of an effect that the simulator holds."""
    held = {member.cause.name for member in held_members(fit.hypothesis.problem)}
    return any({shrunk_name(fit, member, method), _even_name(fit, member, method)} & held
               for member in fit.hypothesis.members)


def shrunk_name(fit: Fit, member: Member, method: Method) -> str:
    """Name of the cause, or of the simpler one that it is there or with a parameter near zero."""
    if member.cause.at_first_joint and member.joints == (0,):
        return member.cause.at_first_joint
    if not member.cause.without:
        return member.cause.name
    simpler, *parameters = member.cause.without
    shrunk = all(_is_shrunk(fit, member, parameter, method) for parameter in parameters)
    return simpler if shrunk else member.cause.name


def _is_shrunk(fit: Fit, member: Member, parameter: str, method: Method) -> bool:
    """Whether a parameter is next to zero at all joints, by its size and by its spread.

    One that must be positive is so at its lower bound.
    """
    joints = list(member.joints)
    (lower,) = (number.lower for number in member.cause.numbers if number.name == parameter)
    if lower > 0.0:
        least = (1.0 + method.fitting.shrunk_share) * lower
        return bool(np.all(_value(fit, member, parameter) < least))
    spread = [_spread(fit, f"{member.name}.{parameter}", k) for k in joints]
    limit = np.minimum(
        method.fitting.shrunk_share * np.abs(np.asarray(member.sizes[parameter])[..., joints]),
        method.fitting.shrunk_deviations * np.array(spread))
    return bool(np.all(np.abs(_value(fit, member, parameter)) < limit))


def _spread(fit: Fit, key: str, k: int) -> float:
    """Least standard deviation of a parameter at joint k; infinite where it is not fitted."""
    return min((spread for parameter, spread in zip(fit.hypothesis.free_parameters, fit.spread)
                if parameter.key == key and parameter.joint in (None, k)), default=np.inf)


def _even_name(fit: Fit, member: Member, method: Method) -> str:
    """As `shrunk_name`, where two parameters are equal: an offset of the drive can hide that."""
    if not member.cause.even:
        return member.cause.name
    simpler, *pair = member.cause.even
    one, other = (_value(fit, member, parameter) for parameter in pair)
    equal = np.all(np.abs(one - other) <= method.fitting.shrunk_share * np.abs(one + other))
    return simpler if equal else member.cause.name


def _value(fit: Fit, member: Member, parameter: str) -> np.ndarray:
    return fit.hypothesis.values[f"{member.name}.{parameter}"][..., list(member.joints)]
