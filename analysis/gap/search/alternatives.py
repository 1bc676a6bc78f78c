"""Causes that look alike: when one of them leads, the others are fitted as well.

Plain Coulomb friction is inside every other dry friction; a lag and a delay differ only at high
frequency; a ripple of low order is a spring.  A ranking that holds one of them without the
other says less than the log does.  And of several causes that lead together, each must show that
it is needed.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes import drive, friction, load, sensor
from clie_blocks.analysis.gap.fitting.hypothesis import Member, hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.fitting.nesting import simpler_names
from clie_blocks.analysis.gap.search.candidates import Candidate, fitted_members

TIMES = {"actuator_lag": (drive.TIME_DELAY, sensor.ENCODER_DELAY),
         "time_delay": (drive.ACTUATOR_LAG,)}
DRY = ("coulomb", "asymmetric_coulomb", "stribeck", "load_dependent_friction", "presliding",
       "friction_drift")
FLOOR = 0.4  # excess per sample above which a cause that shrank to a simpler one starts again
CHANCE = 1.0  # chi^2: a fit that is worse by less has not ended in a false minimum
SLOW = 0.03  # rad/s: speed below which Stribeck friction rises, to start from


def alternatives(found, fits, causes, bench, tried=()):
    """Return candidates with one cause of a fit left out, or replaced by a look-alike.

    Where much is left, also with one left out and another replaced: a second cause may have made
    up for the wrong one of some look-alikes.  Causes that were fitted already start again where
    they do better with the leader's numbers as they are: their fit had ended in a false minimum.

    Parameters
    ----------
    found : Fit
        The fit that leads.
    fits : list of Fit
        What has been fitted already.
    causes : sequence of Cause
        What to look for.
    bench : Bench
        Whitening.
    tried : sequence of Candidate
        Siblings of former leaders.

    """
    stuck, reached = excess(found) > FLOOR, {}
    for fit in fits:
        keys = frozenset(stuck and simpler_names(fit) or _keys(fit.hypothesis.members))
        reached[keys] = min(fit.cost, reached.get(keys, np.inf))
    tried = {_keys(candidate.members) for candidate in tried}
    new = {_keys(some.members): some for some in _rivals(found, causes, stuck)}
    return [some for keys, some in new.items() if keys not in tried
            and (keys not in reached or _cost(some, bench) < reached[keys] - CHANCE)]


def _rivals(found, causes, stuck):
    """Candidates that may explain what a fit explains."""
    members = fitted_members(found.hypothesis)
    possible = [cause for cause in causes
                if found.hypothesis.problem.chain.known or not cause.needs_links]
    fewer = [(*members[:k], *members[k + 1:]) for k in range(len(members))]
    rivals = [Candidate(some, 0.0, found) for some in fewer if some]
    for some in (members, *(fewer if stuck else ())):
        rivals += _with_swapped_cause(some, found, possible)
    return [one for one in rivals if len(_names(one.members)) == len(one.members)]


def _with_swapped_cause(members, found, causes):
    """Candidates with one of some members of a fit replaced by a look-alike."""
    return [Candidate((*members[:k], other, *members[k + 1:]), 0.0, _with_even_numbers(found, member))
            for k, member in enumerate(members)
            for other in _is_alike(member, causes) if other.cause in causes]


def _with_even_numbers(found, member):
    """Fit whose offset holds what is lost with friction that differs between the directions."""
    if "forward" not in member.values:
        return found
    at, lost = found.hypothesis, (member.values["forward"] - member.values["backward"]) / 2
    return dataclasses.replace(found, hypothesis=at.with_values(
        {**at.values, "load": at.values["load"] + lost}))


def _cost(candidate, bench):
    """Cost of causes as they start beside the numbers of the leader."""
    at = hypothesis(bench.problem, candidate.members, candidate.after.hypothesis)
    return at.stray() @ at.stray() + sum(
        (part**2).sum() for j in range(len(bench.problem.fit))
        for part in bench.residuals(at.means(j, [at.values]), j))


def _keys(members):
    return frozenset(member.cause.key for member in members)


def _names(members):
    return frozenset(member.cause.name for member in members)


def _is_alike(member, causes):
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
        return [Member(cause, member.joints, values, member.sizes) for cause in TIMES[name]]
    if name == "torque_ripple":
        steep = values["order"] * np.hypot(values["sine"], values["cosine"]) + 1e-12
        return [Member(load.SPRING, member.joints, {"stiffness": 0.1 * steep},
                       {"stiffness": steep})]
    if name not in DRY or member.cause.variant == "viscous":
        return []
    level = _level(values)
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


def _level(values):
    """Level of plain friction that comes near another one."""
    if "forward" in values:
        return (values["forward"] + values["backward"]) / 2
    return values["level"] + values.get("change", 0.0) / 2
