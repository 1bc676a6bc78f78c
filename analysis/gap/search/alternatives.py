"""Causes with similar signatures: when one of them leads, its alternatives are fitted as well.

Plain Coulomb friction is inside every other dry friction, and contacts that bend before they slide
bend alike; a lag and a delay differ only at high frequency, and jitter is half a delay; ripples
differ only in what they grow with; one of low order is a spring, and so are stops without play.
A ranking that holds one of them without the other says less than the log does.  And of several
causes that lead together, each must show that it is needed.
"""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes import drive, friction, load, sensor, timed, transmission
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.description import is_of_coupling
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Member,
    Values,
    build_hypothesis,
    chi2_by_joint,
)
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import (
    Candidate,
    cause_keys,
    compatible,
    fitted_members,
    with_member,
)
from clie_blocks.analysis.gap.search.elastic_gears import ELASTIC, other_gears, ringing_gear

Keys = frozenset[str]

_SIMILAR_TIMES = {"actuator_lag": (drive.TIME_DELAY, sensor.ENCODER_DELAY),
                  "time_delay": (drive.ACTUATOR_LAG,),
                  "tick_jitter": (drive.TIME_DELAY, sensor.ENCODER_DELAY),
                  "packet_hold": (drive.TIME_DELAY, sensor.ENCODER_DELAY)}
_DRY = ("coulomb", "asymmetric_coulomb", "stribeck", "load_dependent_friction", "presliding",
        "dahl", "maxwell_slip", "position_dependent_friction", "friction_drift")
_BENDING = {"presliding": 1.0, "dahl": 1.0, "maxwell_slip": 2.0}  # reach of equal stiffness
_BRISTLE_TIME = 0.01  # s: damping over stiffness of a contact, to start from
_DRAG_DRIFT, _DRY_DRIFT = friction.FRICTION_DRIFT
_DRIFT_TIMES = ("time_constant", "since")
_RIPPLES = (drive.TORQUE_RIPPLE, drive.COMMUTATION_RIPPLE, drive.GEAR_MESH_RIPPLE)
_STRIBECK_SPEED = 0.03  # rad/s, below which Stribeck friction rises, to start from
_STRIBECK_EXCESS = 0.3  # of the level, to start from
_LOAD_SLOPE = 0.1  # N m of friction per N m of load, to start from
FEW = 2  # causes: of more, leaving one out and replacing another is a search of its own
_SPRING_SHARE = 0.1  # of the steepest slope of a ripple, to start from


def alternatives(leader: Fit, fits: Sequence[Fit], causes: Sequence[Cause],
                 residuals: ResidualModel, tried: Sequence[Candidate] = ()) -> list[Candidate]:
    """Return candidates with one cause of a fit left out, or replaced by an alternative.

    Where much is left by two causes, also with one left out and the other replaced: a second cause
    may have made up for the wrong one of some alternatives.  Causes that were fitted already start
    again where they do better with the leader's parameters as they are: their fit had ended in a
    false minimum.  Those that were tried for former leaders do not, nor those that leave no more
    than the leader does.
    """
    method, least = residuals.method, residuals.method.search.false_minimum_gain
    much_left = leader.excess > method.calibration.healthy
    reached: dict[Keys, float] = {}
    for fit in fits:
        keys = cause_keys(fit.hypothesis.members)
        reached[keys] = min(fit.cost, reached.get(keys, np.inf))
    known = {cause_keys(candidate.members) for candidate in tried}
    by_keys = {cause_keys(candidate.members): candidate
               for candidate in (*_all_alternatives(leader, causes, much_left, residuals),
                                 *_alike_alone(leader, fits, much_left, residuals),
                                 *_elastic_for_loose(leader, fits, causes, residuals),
                                 *_ringing_for_periodic(leader, fits, causes, residuals))}
    return [candidate for keys, candidate in by_keys.items() if keys not in known
            and (keys not in reached or (
                reached[keys] > leader.cost + least
                and _start_cost(candidate, residuals) < reached[keys] - least))]


def _all_alternatives(leader: Fit, causes: Sequence[Cause], much_left: bool,
                      residuals: ResidualModel) -> list[Candidate]:
    """Candidates that may explain what a fit explains."""
    members = fitted_members(leader.hypothesis)
    possible = [cause for cause in causes
                if leader.hypothesis.problem.links.known or not cause.needs_links]
    fewer = [(*members[:k], *members[k + 1:]) for k in range(len(members))]
    candidates = [Candidate(some, 0.0, leader) for some in fewer if some]
    candidates += [Candidate(some, 0.0, leader)
                   for some in _with_drift_apart(members, possible, residuals.problem)]
    for some in (members, *(fewer if much_left and len(members) <= FEW else ())):
        candidates += _with_swapped_cause(some, leader, possible, residuals)
    return [candidate for candidate in candidates
            if len({member.cause.name for member in candidate.members}) == len(candidate.members)
            and holds_its_coupling(candidate.members)]


def holds_its_coupling(members: Iterable[Member]) -> bool:
    """Whether coupled links are among some causes, if one is a number of theirs."""
    causes = [member.cause for member in members]
    return load.COUPLING in causes or not any(is_of_coupling(cause) for cause in causes)


def _with_swapped_cause(members: tuple[Member, ...], leader: Fit, causes: Sequence[Cause],
                        residuals: ResidualModel) -> Iterator[Candidate]:
    """Candidates with one of some members of a fit replaced by an alternative."""
    for k, member in enumerate(members):
        beside = (*members[:k], *members[k + 1:])
        gears = (other_gears(member, beside, leader, residuals)
                 if member.cause in ELASTIC and set(ELASTIC) <= set(causes) else ())
        for other in (*_other_forms(member, causes), *similar_members(member, residuals.problem),
                      *gears):
            if other.cause not in causes:
                continue
            swapped: tuple[Member, ...] | None = (*members[:k], other, *members[k + 1:])
            if any(_holds(other, one) for one in beside):
                swapped = with_member(beside, other)
            if swapped is not None:
                yield Candidate(swapped, 0.0, _with_even_friction(leader, member))


def _with_drift_apart(members: tuple[Member, ...], causes: Sequence[Cause], problem: Problem,
                      ) -> Iterator[tuple[Member, ...]]:
    """Members with a dry friction that drifts as an even one beside a drag that drifts.

    As the one stood for both, another cause may have made up for it at the same joint.
    """
    if not {friction.COULOMB, _DRAG_DRIFT} <= {*causes}:
        return
    for k, member in enumerate(members):
        if member.cause is _DRY_DRIFT:
            beside = (*members[:k], *members[k + 1:])
            apart = _dry_drift_apart(member, problem)
            yield (*beside, *apart)
            yield from ((*(one for one in beside if one is not other), *apart)
                        for other in beside if set(other.joints) <= set(member.joints))


def _dry_drift_apart(member: Member, problem: Problem) -> tuple[Member, Member]:
    """Coulomb friction of the mean level, and a drag that changes by as much at usual speeds."""
    level, change = member.values["level"], member.values["coulomb_change"]
    speed = np.sqrt(np.mean([np.mean(np.gradient(log.q, problem.period, axis=0)**2, axis=0)
                             for log in problem.fit], axis=0)) + 1e-9
    times: Values = {key: member.values[key] for key in _DRIFT_TIMES}
    spans: Values = {key: member.sizes[key] for key in _DRIFT_TIMES if key in member.sizes}
    mean = level + change / 2
    return (Member(friction.COULOMB, member.joints, {"level": mean},
                   {"level": np.abs(mean) + 1e-9}),
            Member(_DRAG_DRIFT, member.joints, {"viscous_change": change / speed, **times},
                   {"viscous_change": (np.abs(change) + 1e-9) / speed, **spans}))


def _holds(member: Member, simpler: Member) -> bool:
    """Whether a member contains another one at a joint of its own."""
    return (simpler.cause.name in member.cause.without
            and not set(member.joints).isdisjoint(simpler.joints))


def _alike_alone(leader: Fit, fits: Sequence[Fit], much_left: bool, residuals: ResidualModel,
                 ) -> Iterator[Candidate]:
    """Candidates with one cause of several replaced by one that explained about as much alone.

    A spring may have come before a payload, as alone the two are hardly told apart.  Where little
    is left, fewer are tried.
    """
    method, members = residuals.method.search, fitted_members(leader.hypothesis)
    alone = {fit.hypothesis.members[0].cause.key: fit for fit in fits
             if len(fit.hypothesis.members) == 1}
    most = method.most_alike_alone if much_left else method.least_alike_alone
    for k, member in enumerate(members if len(members) > 1 else ()):
        own, beside = alone.get(member.cause.key), (*members[:k], *members[k + 1:])
        if own is None:
            continue
        near = [fit for fit in alone.values() if fit is not own
                and abs(fit.excess - own.excess) < (method.alike_alone - 1.0) * own.excess]
        others = [fitted_members(fit.hypothesis)[0] for fit in sorted(
            near, key=lambda one: abs(one.excess - own.excess))]
        fitting = [other for other in others if set(other.joints) & set(member.joints)
                   and all(compatible(other, one) for one in beside)]
        for other in fitting[:most]:
            yield Candidate((*members[:k], other, *members[k + 1:]), 0.0, leader)


def _elastic_for_loose(leader: Fit, fits: Sequence[Fit], causes: Sequence[Cause],
                       residuals: ResidualModel) -> Iterator[Candidate]:
    """Candidates with all elastic gears in the place of a loose one, started from the best."""
    members = fitted_members(leader.hypothesis)
    elastic = min((fit for fit in fits if len(fit.hypothesis.members) == 1
                   and fit.hypothesis.members[0].cause in ELASTIC),
                  key=lambda fit: fit.cost, default=None)
    if elastic is None or not set(ELASTIC) <= set(causes):
        return
    gear = fitted_members(elastic.hypothesis)[0]
    for k, member in enumerate(members):
        if member.cause is transmission.BACKLASH:
            before, after = members[:k], members[k + 1:]
            for other in other_gears(gear, (*before, *after), elastic, residuals):
                yield Candidate((*before, other, *after), 0.0, elastic)


def _ringing_for_periodic(leader: Fit, fits: Sequence[Fit], causes: Sequence[Cause],
                          residuals: ResidualModel) -> Iterator[Candidate]:
    """Candidates with an elastic gear that rings in the place of a periodic disturbance.

    Of a gear that rings a periodic disturbance explains a fair share, but not all.
    """
    method, members = residuals.method, fitted_members(leader.hypothesis)
    much = method.search.fair_share * max(fit.excess for fit in fits)
    if (not method.calibration.healthy < leader.excess < much
            or transmission.JOINT_ELASTICITY not in causes
            or any(member.cause.moves_apart for member in members)):
        return
    for k, member in enumerate(members):
        if member.cause is timed.PERIODIC_DISTURBANCE:
            beside = (*members[:k], *members[k + 1:])
            gear = ringing_gear(member.joints, beside, leader, residuals)
            yield Candidate((*beside, gear), 0.0, leader)


def _with_even_friction(leader: Fit, member: Member) -> Fit:
    """Fit whose offset holds what is lost with friction that differs between the directions."""
    if "forward" not in member.values:
        return leader
    lost = (member.values["forward"] - member.values["backward"]) / 2
    hypothesis = leader.hypothesis
    return dataclasses.replace(leader, hypothesis=hypothesis.with_values(
        {**hypothesis.values, "load": hypothesis.values["load"] + lost}))


def _start_cost(candidate: Candidate, residuals: ResidualModel) -> float:
    """Cost of causes as they start with the leader's joint model."""
    joint_model = candidate.extends.hypothesis if candidate.extends else None
    start = build_hypothesis(residuals.problem, candidate.members, joint_model)
    violation = start.prior_violations(residuals.method.fitting.prior_softness)
    return violation @ violation + sum(
        float(chi2.sum()) for j in range(len(residuals.problem.fit))
        for chi2 in chi2_by_joint([start], residuals, j))


def _other_forms(member: Member, causes: Sequence[Cause]) -> list[Member]:
    """The same effect in another form of the same parameters."""
    return [dataclasses.replace(member, cause=cause) for cause in causes
            if cause.name == member.cause.name and cause.key != member.cause.key
            and cause.numbers == member.cause.numbers]


def similar_members(member: Member, problem: Problem) -> list[Member]:
    """Return other effects that may explain the same, with parameters to start from."""
    name = member.cause.name
    if name in _SIMILAR_TIMES:
        return other_delays(member)
    if member.cause in _RIPPLES:
        spring = [_spring_like(member)] if name == "torque_ripple" else []
        return [*spring, *_ripples_like(member, problem)]
    if name == "soft_stop":
        stiffness = member.values["stiffness"]
        return [Member(load.SPRING, member.joints, {"stiffness": stiffness},
                       {"stiffness": stiffness + 1e-12})]
    if name == "step_fault" and member.cause.variant == "friction":
        return list(_dry_friction_like(member))  # one that sets in early is there all the time
    if name == "rest_time_breakaway":
        return [_stribeck_like(member)]
    if name in _DRY and member.cause.variant != "viscous":
        bending = _bending_like(member) if name in _BENDING else ()
        return [other for other in (*_dry_friction_like(member), *bending)
                if other.cause.name != name]
    return []


def other_delays(member: Member) -> list[Member]:
    """Return what is late alike: a lag for a delay, and a delay for one that changes."""
    if member.cause.name not in _SIMILAR_TIMES:
        return []
    number, mean = member.cause.numbers[0].name, _mean_of_largest(member)
    time, size = mean * member.values[number], mean * member.sizes[number]
    return [Member(cause, member.joints, {cause.numbers[0].name: time},
                   {cause.numbers[0].name: size})
            for cause in _SIMILAR_TIMES[member.cause.name]]


def _mean_of_largest(member: Member) -> np.ndarray | float:
    """Mean delay over the largest: one that changes grows evenly and falls back."""
    if member.cause.name == "tick_jitter":
        return 0.5
    if member.cause.name == "packet_hold":
        return 0.5 * member.values["hold"] / member.values["interval"]
    return 1.0


def _spring_like(ripple: Member) -> Member:
    """A spring in the place of less than a wave of ripple."""
    values = ripple.values
    steepest = values["order"] * np.hypot(values["sine"], values["cosine"]) + 1e-12
    return Member(load.SPRING, ripple.joints, {"stiffness": _SPRING_SHARE * steepest},
                  {"stiffness": steepest})


def _ripples_like(ripple: Member, problem: Problem) -> Iterator[Member]:
    """Ripples of the same waves that grow with other torques."""
    torque = np.sqrt(np.mean([np.mean(log.u**2, axis=0) for log in problem.fit], axis=0)) + 1e-12
    preload = drive.PRELOAD * torque

    def height(member: Member) -> np.ndarray:
        """Amplitude of a ripple over its parameters [N m]."""
        if member.cause is drive.TORQUE_RIPPLE:
            return np.ones_like(torque)
        return torque + member.values.get("preload", 0.0 * torque)

    for cause in _RIPPLES:
        if cause is not ripple.cause:
            extra = {"preload": preload} if cause is drive.GEAR_MESH_RIPPLE else {}
            unscaled = Member(cause, ripple.joints, extra, extra)
            scale = height(ripple) / height(unscaled)
            scales = {"sine": scale, "cosine": scale, "order": 1.0}
            yield dataclasses.replace(
                unscaled, values={key: ripple.values[key] * scales[key] for key in scales} | extra,
                sizes={key: ripple.sizes[key] * scales[key] for key in scales} | extra)


def _bending_like(member: Member) -> Iterator[Member]:
    """Contacts of the same level and stiffness that bend before they slide."""
    level, reach = member.values["level"], member.values["reach"] / _BENDING[member.cause.name]
    size, damping = np.abs(level) + 1e-9, _BRISTLE_TIME * np.abs(level) / reach
    yield Member(friction.PRESLIDING, member.joints,
                 {"level": level, "reach": reach, "bristle_damping": damping},
                 {"level": size, "reach": reach, "bristle_damping": damping + 1e-9})
    for cause in (friction.DAHL, friction.MAXWELL_SLIP):
        equal = _BENDING[cause.name] * reach
        sharp = {"exponent": 1.0 + 0.0 * reach} if cause is friction.DAHL else {}
        yield Member(cause, member.joints, {"level": level, "reach": equal, **sharp},
                     {"level": size, "reach": equal, **sharp})


def _stribeck_like(rest: Member) -> Member:
    """Excess that is there at once, in the place of one that grows while the joint rests."""
    excess, speed = rest.values["rise"], rest.values["velocity"]
    size = rest.sizes["rise"]
    return Member(friction.STRIBECK, rest.joints,
                  {"level": 0.0 * excess, "excess": excess, "velocity": speed},
                  {"level": size, "excess": size, "velocity": rest.sizes["velocity"]})


def _dry_friction_like(member: Member) -> Iterator[Member]:
    """All dry frictions of about the same level as another one."""
    level = _level(member.values)
    size, excess = np.abs(level) + 1e-9, _STRIBECK_EXCESS * level
    speed = _STRIBECK_SPEED + 0 * level
    yield Member(friction.COULOMB, member.joints, {"level": level}, {"level": size})
    yield Member(friction.ASYMMETRIC_COULOMB, member.joints,
                 {"forward": level, "backward": level}, {"forward": size, "backward": size})
    yield Member(friction.STRIBECK, member.joints,
                 {"level": level, "excess": excess, "velocity": speed},
                 {"level": size, "excess": size, "velocity": speed})
    for form in friction.LOAD_DEPENDENT_FRICTION:
        yield Member(form, member.joints, {"level": level, "share": 0.0 * level},
                     {"level": size, "share": _LOAD_SLOPE + 0.0 * level})


def _level(values: Values) -> np.ndarray:
    """Level of plain friction that comes near another one."""
    if "forward" in values:
        return (values["forward"] + values["backward"]) / 2
    return values["level"] + values.get("coulomb_change", 0.0) / 2
