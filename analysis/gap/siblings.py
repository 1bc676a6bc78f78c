"""Causes that look alike: when one of them leads, the others are fitted as well.

Plain Coulomb friction is inside every other dry friction; a lag and a delay differ only at high
frequency.  A ranking that holds one of them without the other says less than the log does.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.candidates import Candidate
from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.hypothesis import Member

LIKE = {"actuator_lag": drive.TIME_DELAY, "time_delay": drive.ACTUATOR_LAG}
DRY = ("asymmetric_coulomb", "stribeck", "load_dependent_friction", "presliding",
       "friction_drift")


def siblings(found, fits, causes):
    """Return candidates with one cause of a fit replaced by its look-alike.

    Parameters
    ----------
    found : Fit
        The fit that leads.
    fits : list of Fit
        What has been fitted already.
    causes : sequence of Cause
        What to look for.

    """
    known = {_keys(fit.hypothesis.members) for fit in fits}
    members = found.hypothesis.members
    result = []
    for place, member in enumerate(members):
        other = _sibling(found.hypothesis, member)
        if other is None or other.cause not in causes:
            continue
        swapped = [_as_fitted(found.hypothesis, one) for one in members]
        swapped[place] = other
        if _keys(swapped) not in known:
            result.append(Candidate(tuple(swapped), 0.0))
    return result


def _keys(members):
    return frozenset(member.cause.key for member in members)


def _as_fitted(at, member):
    """Member whose numbers are the fitted ones."""
    values = {number.name: at.values[f"{member.name}.{number.name}"]
              for number in member.cause.numbers}
    return dataclasses.replace(member, values=values)


def _sibling(at, member):
    values = _as_fitted(at, member).values
    if member.cause.name in LIKE:
        return Member(LIKE[member.cause.name], member.joints, values, member.sizes)
    if member.cause.name in DRY and member.cause.variant != "viscous":
        level = (values["level"] if "level" in values
                 else (values["forward"] + values["backward"]) / 2)
        size = np.abs(level) + 1e-9
        return Member(friction.COULOMB, member.joints, {"level": level}, {"level": size})
    return None
