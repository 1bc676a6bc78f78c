"""From a screening to hypotheses worth a full fit: single causes, and pairs of them."""

import dataclasses
import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.fitting.law_view import law_view
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.drive_faults import drive_fault_candidates
from clie_blocks.analysis.gap.search.events import (
    fault_candidates,
    periodic_candidates,
    whitened_errors,
)
from clie_blocks.analysis.gap.search.ripple_spectrum import ripple_candidates
from clie_blocks.analysis.gap.search.screening import Column, Screen
from clie_blocks.analysis.gap.search.subset_regression import regression


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """Some causes with parameters to start from, and what they are expected to explain.

    Parameters
    ----------
    members : tuple of Member
        The causes.
    score : float
        Expected drop of chi^2 less what its parameters cost; 0 for an alternative of a fit.
    extends : Fit or None
        The fit whose joint model it starts with: one that it extends, or whose causes it swaps;
        None for the refitted nominal model.

    """

    members: tuple[Member, ...]
    score: float
    extends: Fit | None = None


class Use(NamedTuple):
    """A cause at one joint: the drop of chi^2 less its price, its best probe, and coefficients."""

    score: float
    column: Column
    theta: tuple[float, ...]


def singles(screen: Screen, residuals: ResidualModel, fit: Fit, causes: Sequence[Cause],
            ) -> list[Candidate]:
    """Return one candidate per cause (and variant), best first; `fit` is what was screened."""
    method, price = residuals.method, screen.parameter_price
    by_cause: dict[str, list[Column]] = {}
    for column in screen.columns:
        by_cause.setdefault(column.cause.key, []).append(column)
    of_robot = [_robot_wide(columns, screen) for columns in by_cause.values()
                if columns[0].cause.shared]
    uses = [_best_uses(columns, screen) for columns in by_cause.values()
            if not columns[0].cause.shared]
    candidates = [*of_robot, *(_joint_by_joint(of_cause, method) for of_cause in uses)]
    much = _joints_that_leave_much(screen, method)
    open_joints = [k for k in much if not _is_settled(screen.target[k], k, uses, method)]
    candidates += [_from_search(member, drop, price, residuals.problem.fit_runs, method)
                   for member, drop in _searched(residuals, fit, causes, much, open_joints)]
    return sorted(candidates, key=lambda candidate: -candidate.score)


def _joints_that_leave_much(screen: Screen, method: Method) -> list[int]:
    """Joints that leave a fair share of what all of them leave."""
    left = [float(target @ target) for target in screen.target]
    return [k for k, own in enumerate(left) if own >= method.search.searched_share * sum(left)]


def _is_settled(target: np.ndarray, k: int, uses: Sequence[Mapping[int, Use]], method: Method,
                ) -> bool:
    """Whether one of the gridded causes explains all but a little of what joint k leaves."""
    explained = max((of_cause[k].score for of_cause in uses), default=0.0)
    return explained > (1.0 - method.search.settled_share) * float(target @ target)


def _searched(residuals: ResidualModel, fit: Fit, causes: Sequence[Cause],
              of_ripples: Collection[int], of_drives: Collection[int],
              ) -> Iterator[tuple[Member, np.ndarray]]:
    """Causes that are searched for rather than gridded, and the drop of chi^2 per joint.

    Ripples, and faults of the drive, are sought at some joints only: that takes longest.
    """
    fit, residuals, views = law_view(fit, residuals)
    errors = whitened_errors(residuals, fit)
    for found in (periodic_candidates(residuals, fit, errors, causes),
                  fault_candidates(residuals, fit, errors, causes),
                  ripple_candidates(residuals, fit, errors, causes, of_ripples),
                  drive_fault_candidates(residuals, fit, errors, causes, of_drives)):
        for member, drop in found:
            yield member, views * drop


def of_each_joint(screen: Screen, residuals: ResidualModel, fit: Fit, causes: Sequence[Cause],
                  ) -> list[list[Candidate]]:
    """Return the causes that may explain one joint, those of each joint best first.

    A cause of the whole robot is none of them.
    """
    found: list[list[Candidate]] = []
    for k, target in enumerate(screen.target):
        by_cause: dict[str, list[Column]] = {}
        for column in screen.columns:
            if column.joint == k and not column.cause.shared:
                by_cause.setdefault(column.cause.key, []).append(column)
        uses = [_best_probe(columns, target, screen.parameter_price)
                for columns in by_cause.values()]
        found.append([Candidate((_member((k,), {k: use}),), use.score) for use in uses])
    much = _joints_that_leave_much(screen, residuals.method)
    for member, drop in _searched(residuals, fit, causes, range(len(screen.target)), much):
        if not member.cause.shared:
            spent = spent_parameters(member, residuals.problem.fit_runs)
            paid = drop - spent * screen.parameter_price
            for k, score in enumerate(paid):
                found[k].append(Candidate((dataclasses.replace(member, joints=(k,)),),
                                          float(score)))
    least = residuals.method.search.joint_gain
    return [sorted((one for one in of_joint if one.score > least), key=lambda one: -one.score)
            for of_joint in found]


def _robot_wide(columns: Sequence[Column], screen: Screen) -> Candidate:
    """One set of parameters for all joints: the joints' regressions are stacked."""
    joints, target = tuple(range(len(screen.target))), np.concatenate(screen.target)
    best: Use | None = None
    for probe in {column.probe for column in columns}:
        parts = sorted((column for column in columns if column.probe == probe),
                       key=lambda column: column.joint)
        stacked = dataclasses.replace(parts[0], data=np.concatenate([part.data for part in parts]))
        gain, = regression([stacked], target).gains([[0]])
        use = Use(gain.drop - stacked.size * screen.parameter_price, stacked, gain.theta[0])
        if best is None or use.score > best.score:
            best = use
    assert best is not None, "a cause has at least one probe"
    return Candidate((_member(joints, {k: best for k in joints}),), best.score)


def _best_uses(columns: Sequence[Column], screen: Screen) -> dict[int, Use]:
    """Each joint with the probe that explains most of it."""
    return {k: _best_probe([column for column in columns if column.joint == k], target,
                           screen.parameter_price) for k, target in enumerate(screen.target)}


def _joint_by_joint(best: Mapping[int, Use], method: Method) -> Candidate:
    """A cause at the joints where it explains much."""
    joints = joints_worth_keeping(np.array([use.score for use in best.values()]), method)
    member = _member(joints, {k: best[k] for k in joints})
    return Candidate((member,), float(sum(best[k].score for k in joints)))


def _best_probe(columns: Sequence[Column], target: np.ndarray, price: float) -> Use:
    gains = regression(columns, target).gains([[i] for i in range(len(columns))])
    i = int(np.argmax([gain.drop for gain in gains]))
    return Use(gains[i].drop - columns[i].size * price, columns[i], gains[i].theta[0])


def joints_worth_keeping(scores: np.ndarray, method: Method) -> tuple[int, ...]:
    """Joints at which a cause is worth its parameters: the best one, and all that add enough."""
    top = scores.max()
    least = max(method.search.joint_gain, method.search.joint_share * top)
    return tuple(k for k, score in enumerate(scores) if score == top or score > least)


def _member(joints: tuple[int, ...], uses: Mapping[int, Use]) -> Member:
    """Member whose parameters at each joint are those of the joint's best probe."""
    template = uses[joints[0]].column.member
    values = {name: np.array(value, float) for name, value in template.values.items()}
    for k in joints:
        _, column, theta = uses[k]
        for name in values:
            values[name][..., k] = column.member.values[name][..., k]
        for name, coefficient in zip(column.amplitudes, theta):
            values[name][..., k] *= coefficient
    return Member(template.cause, joints, values, template.sizes)


def _from_search(member: Member, drop: np.ndarray, price: float, logs: int, method: Method,
                 ) -> Candidate:
    """Candidate of a cause that was searched for, with its drop of chi^2 per joint."""
    score = drop - price * spent_parameters(member, logs)
    if member.cause.shared:
        return Candidate((member,), float(drop.sum() - price * spent_parameters(member, logs)))
    joints = joints_worth_keeping(score, method)
    return Candidate((dataclasses.replace(member, joints=joints),),
                     float(score[list(joints)].sum()))


def spent_parameters(member: Member, logs: int) -> int:
    """Numbers of a cause at one joint; those that differ between logs count in each."""
    return sum((logs if number.scope == "log" else 1) for number in member.cause.numbers)


class _PairUse(NamedTuple):
    """A pair at one joint: together, one of them, or none."""

    score: float
    first: Use | None = None
    second: Use | None = None


@dataclasses.dataclass(frozen=True)
class _JointTable:
    """Best single causes and pairs at one joint, by key."""

    single: dict[str, Use]
    double: dict[tuple[str, str], _PairUse]

    def best_use(self, one: str, two: str) -> _PairUse:
        """Best of two causes at this joint: none, the first, the second, or both."""
        uses = [_PairUse(0.0)]
        if one in self.single:
            uses.append(_PairUse(self.single[one].score, first=self.single[one]))
        if two in self.single:
            uses.append(_PairUse(self.single[two].score, second=self.single[two]))
        if (one, two) in self.double:
            uses.append(self.double[one, two])
        return max(uses, key=lambda use: use.score)


def pairs(screen: Screen, method: Method) -> list[Candidate]:
    """Return a candidate for every pair of causes, best first, by exhaustive search.

    Joints explain themselves apart: at each joint the pair may act together, alone, or not.
    """
    tables = [_joint_table([column for column in screen.columns if column.joint == k], target,
                           screen.parameter_price, method)
              for k, target in enumerate(screen.target)]
    keys = sorted({key for table in tables for key in table.single})
    candidates = []
    for one, two in itertools.combinations(keys, 2):
        uses = [table.best_use(one, two) for table in tables]
        first = _pair_member([use.first for use in uses], uses)
        second = _pair_member([use.second for use in uses], uses)
        if first and second and compatible(first, second):
            candidates.append(Candidate((first, second), float(sum(use.score for use in uses))))
    return sorted(candidates, key=lambda candidate: -candidate.score)


def _joint_table(columns: Sequence[Column], target: np.ndarray, price: float, method: Method,
                 ) -> _JointTable:
    rule = regression(columns, target)
    gains = rule.gains([[i] for i in range(len(columns))])
    uses = [Use(gain.drop - column.size * price, column, gain.theta[0])
            for gain, column in zip(gains, columns)]
    probes: dict[str, list[int]] = {}
    for i in np.argsort([use.score for use in uses])[::-1]:
        of_cause = probes.setdefault(columns[i].cause.key, [])
        if len(of_cause) < method.search.probes_per_cause:
            of_cause.append(int(i))

    together = [(i, j) for one, two in itertools.combinations(sorted(probes), 2)
                for i in probes[one] for j in probes[two]]
    double: dict[tuple[str, str], _PairUse] = {}
    for (i, j), gain in zip(together, rule.gains(together)):
        key = columns[i].cause.key, columns[j].cause.key
        score = gain.drop - (columns[i].size + columns[j].size) * price - method.search.joint_gain
        if key not in double or score > double[key].score:
            double[key] = _PairUse(score, *(Use(score, columns[place], theta)
                                            for place, theta in zip((i, j), gain.theta)))
    return _JointTable({key: uses[some[0]] for key, some in probes.items()}, double)


def _pair_member(of_joints: Sequence[Use | None], pair_uses: Sequence[_PairUse]) -> Member | None:
    """Member of one of a pair, from its use at each joint; None where it acts at none."""
    uses = {k: use for k, use in enumerate(of_joints) if use is not None}
    if not uses:
        return None
    if next(iter(uses.values())).column.cause.shared:
        strongest = max(uses, key=lambda k: pair_uses[k].score)
        uses = {k: uses[strongest] for k in range(len(of_joints))}
    return _member(tuple(uses), uses)


def compatible(one: Member, two: Member) -> bool:
    """Whether two members are two: names differ, neither contains the other, one transmission."""
    nested = one.cause.name in two.cause.without or two.cause.name in one.cause.without
    return (one.cause.name != two.cause.name and not nested
            and not (one.cause.moves_apart and two.cause.moves_apart))


def extensions(fit: Fit, candidates: Iterable[Candidate]) -> Iterator[Candidate]:
    """Candidates that add one cause or more to the members of a fit."""
    for candidate in candidates:
        members: tuple[Member, ...] | None = fitted_members(fit.hypothesis)
        for added in candidate.members:
            members = with_member(members, added) if members is not None else None
        if members is not None:
            yield Candidate(members, candidate.score, fit)


def with_member(members: tuple[Member, ...], added: Member) -> tuple[Member, ...] | None:
    """Members and one more, in the place of those that it contains; None if they clash."""
    kept = tuple(member for member in members if member.cause.name not in added.cause.without)
    for member in members:
        if member not in kept:
            added = _containing(added, member)
    return (*kept, added) if all(compatible(member, added) for member in kept) else None


def _containing(member: Member, simpler: Member) -> Member:
    """Member of a cause that contains a simpler one: as that was fitted, levels added."""
    values = {**member.values, **{name: value for name, value in simpler.values.items()
                                  if name in member.values}}
    if "level" in simpler.values:
        values["level"] = member.values["level"] + simpler.values["level"]
    return dataclasses.replace(member, joints=tuple(sorted({*member.joints, *simpler.joints})),
                               values=values)


def cause_keys(members: Iterable[Member]) -> frozenset[str]:
    """Keys of the causes of some members: what makes two sets of causes the same."""
    return frozenset(member.cause.key for member in members)


def fitted_members(hypothesis: Hypothesis) -> tuple[Member, ...]:
    """Members of a fitted hypothesis with the fitted parameters."""
    return tuple(dataclasses.replace(member, values={
        number.name: hypothesis.values[f"{member.name}.{number.name}"]
        for number in member.cause.numbers}) for member in hypothesis.members)
