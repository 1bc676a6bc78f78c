"""Causes that look alike: when one of them leads, the others are fitted as well.

Plain Coulomb friction is inside every other dry friction; a lag and a delay differ only at high
frequency; a ripple of low order is a spring.  A ranking that holds one of them without the
other says less than the log does.  And of several causes that lead together, each must show that
it is needed.
"""

import dataclasses

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


def siblings(found, fits, causes, tried=()):
    """Return candidates with one cause of a fit left out, or replaced by a look-alike.

    Where much is left, also with one left out and another replaced: a second cause may have made
    up for the wrong one of some look-alikes.

    Parameters
    ----------
    found : Fit
        The fit that leads.
    fits : list of Fit
        What has been fitted already.
    causes : sequence of Cause
        What to look for.
    tried : sequence of Candidate
        Siblings of former leaders.

    """
    members, stuck = as_fitted(found.hypothesis), excess(found) > FLOOR
    known = {_keys(candidate.members) for candidate in tried} | {
        frozenset(stuck and simpler(fit) or _keys(fit.hypothesis.members)) for fit in fits}
    possible = [cause for cause in causes
                if found.hypothesis.problem.chain.known or not cause.needs_links]
    fewer = [(*members[:k], *members[k + 1:]) for k in range(len(members))]
    sets = [*fewer, *_swapped(members, possible)]
    for some in fewer if stuck else ():
        sets += _swapped(some, possible)
    new = {_keys(some): some for some in sets
           if some and len(_names(some)) == len(some) and _keys(some) not in known}
    return [Candidate(some, 0.0, found) for some in new.values()]


def _swapped(members, causes):
    """Sets of members with one of them replaced by a look-alike."""
    return [(*members[:k], other, *members[k + 1:]) for k, member in enumerate(members)
            for other in _alike(member, causes) if other.cause in causes]


def _keys(members):
    return frozenset(member.cause.key for member in members)


def _names(members):
    return frozenset(member.cause.name for member in members)


def _alike(member, causes):
    """Members that may explain the same, with numbers to start from."""
    return [*_other_forms(member, causes), *_other_names(member)]


def _other_forms(member, causes):
    """The same effect in another form of the same numbers."""
    return [dataclasses.replace(member, cause=cause) for cause in causes
            if cause.name == member.cause.name and cause.key != member.cause.key
            and cause.numbers == member.cause.numbers]


def _other_names(member):
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
        *((form, {"level": level, "slope": 0.0 * level},
           {"level": size, "slope": 0.1 + 0.0 * level})
          for form in friction.LOAD_DEPENDENT_FRICTION)]
    return [Member(cause, member.joints, start, sizes) for cause, start, sizes in starts
            if cause.name != name]
