"""Causes that look alike: when one of them leads, the others are fitted as well.

Plain Coulomb friction is inside every other dry friction; a lag and a delay differ only at high
frequency; a ripple of low order is a spring.  A ranking that holds one of them without the
other says less than the log does.  And of several causes that lead together, each must show that
it is needed.
"""

import numpy as np

from clie_blocks.analysis.gap.candidates import Candidate, as_fitted
from clie_blocks.analysis.gap.causes import drive, friction, load
from clie_blocks.analysis.gap.evidence import excess, simpler
from clie_blocks.analysis.gap.hypothesis import Member

TIMES = {"actuator_lag": drive.TIME_DELAY, "time_delay": drive.ACTUATOR_LAG}
DRY = ("coulomb", "asymmetric_coulomb", "stribeck", "load_dependent_friction", "presliding",
       "friction_drift")
FLOOR = 0.4  # excess per sample above which a cause that shrank to a simpler one starts again
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
    stuck = excess(found) > FLOOR
    known = {frozenset(stuck and simpler(fit) or _names(fit.hypothesis.members)) for fit in fits}
    members = as_fitted(found.hypothesis)
    result = []
    for place, member in enumerate(members):
        fewer = (*members[:place], *members[place + 1:])
        if fewer and _names(fewer) not in known:
            known.add(_names(fewer))
            result.append(Candidate(fewer, 0.0))
        for other in _alike(member):
            swapped = [*members[:place], other, *members[place + 1:]]
            names = _names(swapped)
            if other.cause in causes and names not in known and len(names) == len(swapped):
                known.add(names)
                result.append(Candidate(tuple(swapped), 0.0))
    return result


def _names(members):
    return frozenset(member.cause.name for member in members)


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
         {"level": size, "excess": size, "speed": SLOW + 0 * level}),
        (friction.LOAD_DEPENDENT_FRICTION[0], {"level": level, "slope": 0.0 * level},
         {"level": size, "slope": 0.1 + 0.0 * level})]
    return [Member(cause, member.joints, start, sizes) for cause, start, sizes in starts
            if cause.name != name]
