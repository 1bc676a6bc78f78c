"""Causes that look alike: when one of them leads, the others are fitted as well.

Plain Coulomb friction is inside every other dry friction; a lag and a delay differ only at high
frequency; a ripple of low order is a spring.  A ranking that holds one of them without the
other says less than the log does.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.candidates import Candidate
from clie_blocks.analysis.gap.causes import drive, friction, load
from clie_blocks.analysis.gap.hypothesis import Member

TIMES = {"actuator_lag": drive.TIME_DELAY, "time_delay": drive.ACTUATOR_LAG}
DRY = ("coulomb", "asymmetric_coulomb", "stribeck", "load_dependent_friction", "presliding",
       "friction_drift")
SLOW = 0.03  # rad/s: speed below which Stribeck friction rises, to start from


def siblings(found, fits, causes):
    """Return candidates with one cause of a fit replaced by a look-alike.

    Parameters
    ----------
    found : Fit
        The fit that leads.
    fits : list of Fit
        What has been fitted already.
    causes : sequence of Cause
        What to look for.

    """
    known = {_names(fit.hypothesis.members) for fit in fits}
    members = [_as_fitted(found.hypothesis, member) for member in found.hypothesis.members]
    result = []
    for place, member in enumerate(members):
        for other in _alike(member):
            swapped = [*members[:place], other, *members[place + 1:]]
            names = _names(swapped)
            if other.cause in causes and names not in known and len(names) == len(swapped):
                known.add(names)
                result.append(Candidate(tuple(swapped), 0.0))
    return result


def _names(members):
    return frozenset(member.cause.name for member in members)


def _as_fitted(at, member):
    """Member whose numbers are the fitted ones."""
    values = {number.name: at.values[f"{member.name}.{number.name}"]
              for number in member.cause.numbers}
    return dataclasses.replace(member, values=values)


def _alike(member):
    """Members that may explain the same, with numbers to start from."""
    values, name = member.values, member.cause.name
    if name in TIMES:
        return [Member(TIMES[name], member.joints, values, member.sizes)]
    if name == "torque_ripple":
        steep = values["order"] * np.hypot(values["sine"], values["cosine"]) + 1e-12
        return [Member(load.SPRING, member.joints, {"stiffness": 0.1 * steep},
                       {"stiffness": steep})]
    if name not in DRY or member.cause.variant == "viscous":
        return []
    level = (values["level"] if "level" in values
             else (values["forward"] + values["backward"]) / 2)
    size, some = np.abs(level) + 1e-9, 0.3 * level
    starts = [
        (friction.COULOMB, {"level": level}, {"level": size}),
        (friction.ASYMMETRIC_COULOMB, {"forward": level, "backward": level},
         {"forward": size, "backward": size}),
        (friction.STRIBECK, {"level": level, "excess": some, "speed": SLOW + 0 * level},
         {"level": size, "excess": size, "speed": SLOW + 0 * level})]
    return [Member(cause, member.joints, start, sizes) for cause, start, sizes in starts
            if cause.name != name]
