"""From a screening to hypotheses worth a full fit: single causes, and pairs of them."""

import dataclasses
import itertools

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.search.events import (
    fault_candidates,
    periodic_candidates,
    whitened_errors,
)
from clie_blocks.analysis.gap.search.ripple_spectrum import ripple_candidates
from clie_blocks.analysis.gap.search.subset_regression import regression

WORTH = 0.03  # share of a cause's gain that a further joint must add
LEAST = 10.0  # chi^2 that a further joint must add
PROBES = 2  # best probes of each cause that enter the search over pairs


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """Some causes with numbers to start from, and what they are expected to explain.

    Parameters
    ----------
    members : tuple of Member
        The causes.
    score : float
        Expected drop of chi^2 less what its numbers cost.
    after : Fit or None
        The fit whose numbers of the joint model it starts beside: one that it extends, or whose
        causes it swaps; None for the refitted nominal model.

    """

    members: tuple
    score: float
    after: object = None


def parameter_price(found):
    """What one number costs in chi^2, as in BIC."""
    return np.log(found.samples * len(found.target))


def singles(found, bench, after, causes):
    """Return one candidate per cause (and variant), best first.

    Parameters
    ----------
    found : Screen
        The screening.
    bench : Bench
        Whitening.
    after : Fit
        What was screened around.
    causes : sequence of Cause
        What to look for.

    """
    by_cause = {}
    for column in found.columns:
        by_cause.setdefault(column.cause.key, []).append(column)
    result = [(_robot_wide if columns[0].cause.shared else _per_joint)(columns, found)
              for columns in by_cause.values()]
    errors = whitened_errors(bench, after)
    searched = [*periodic_candidates(bench, after, errors, causes), *fault_candidates(bench, after, errors, causes),
                *ripple_candidates(bench, after, errors, causes)]
    for member, drop in searched:
        result.append(_from_event(member, drop, parameter_price(found), len(bench.problem.fit)))
    return sorted(result, key=lambda candidate: -candidate.score)


def _robot_wide(columns, found):
    """One set of numbers for all joints: the joints' regressions are stacked."""
    best = None
    joints = range(len(found.target))
    for probe in {column.probe for column in columns}:
        parts = sorted((c for c in columns if c.probe == probe), key=lambda c: c.joint)
        stacked = dataclasses.replace(parts[0], data=np.concatenate([c.data for c in parts]))
        gain = regression([stacked], np.concatenate(found.target)).gain(0)
        score = gain.drop - stacked.size * parameter_price(found)
        if best is None or score > best[0]:
            best = (score, stacked, gain.theta[0])
    score, column, theta = best
    member = _member(column.cause, tuple(joints), {k: (column, theta) for k in joints})
    return Candidate((member,), score)


def _per_joint(columns, found):
    best = {}
    for k, target in enumerate(found.target):
        own = [column for column in columns if column.joint == k]
        rule = regression(own, target)
        gains = [rule.gain(i) for i in range(len(own))]
        i = int(np.argmax([gain.drop for gain in gains]))
        best[k] = (gains[i].drop - own[i].size * parameter_price(found), own[i], gains[i].theta[0])
    joints = joints_worth_keeping(np.array([best[k][0] for k in sorted(best)]))
    member = _member(columns[0].cause, joints, {k: best[k][1:] for k in joints})
    return Candidate((member,), float(sum(best[k][0] for k in joints)))


def joints_worth_keeping(scores):
    """Joints at which a cause earns its place: the best one, and all that add enough."""
    top = scores.max()
    return tuple(int(k) for k in range(len(scores))
                 if scores[k] == top or scores[k] > max(LEAST, WORTH * top))


def _member(cause, joints, best):
    """Member whose numbers at each joint are those of the joint's best probe."""
    first = best[joints[0]][0]
    values = {name: np.array(value, float) for name, value in first.member.values.items()}
    for k in joints:
        column, theta = best[k]
        for name in values:
            values[name][..., k] = column.member.values[name][..., k]
        for name, coefficient in zip(column.amplitudes, theta):
            values[name][..., k] *= coefficient
    return Member(cause, joints, values, first.member.sizes)


def _from_event(member, drop, cost, logs):
    size = {"periodic_disturbance": 2 * logs + 1, "torque_ripple": 3}.get(member.cause.name,
                                                                          logs + 1)
    if member.cause.shared:
        return Candidate((member,), float(drop.sum() - size * cost))
    score = drop - size * cost
    joints = joints_worth_keeping(score)
    return Candidate((dataclasses.replace(member, joints=joints),),
                     float(score[list(joints)].sum()))


def pairs(found):
    """Return a candidate for every pair of causes, best first, by exhaustive search.

    Joints explain themselves apart: at each joint the pair may act together, alone, or not.
    """
    n, cost = len(found.target), parameter_price(found)
    tables = [_pair_table([c for c in found.columns if c.joint == k], found.target[k], cost)
              for k in range(n)]
    keys = sorted({key for single, _ in tables for key in single})
    result = []
    for one, two in itertools.combinations(keys, 2):
        chosen = [_best_use(table, one, two) for table in tables]
        score = sum(use[0] for use in chosen)
        members = [_pair_member(chosen, i) for i in (0, 1)]
        if all(members) and _compatible(*members):
            result.append(Candidate(tuple(members), float(score)))
    return sorted(result, key=lambda candidate: -candidate.score)


def _pair_table(columns, target, cost):
    """Scores of single causes and pairs at one joint, with the columns that reach them."""
    rule = regression(columns, target)
    gains = [rule.gain(i) for i in range(len(columns))]
    score = [gain.drop - column.size * cost for gain, column in zip(gains, columns)]
    by_cause = {}
    for i in np.argsort(score)[::-1]:
        if len(by_cause.setdefault(columns[i].cause.key, [])) < PROBES:
            by_cause[columns[i].cause.key].append(int(i))
    single = {key: (score[own[0]], ((columns[own[0]], gains[own[0]].theta[0]),))
              for key, own in by_cause.items()}
    double = {}
    for one, two in itertools.combinations(sorted(by_cause), 2):
        best = None
        for i, j in itertools.product(by_cause[one], by_cause[two]):
            gain = rule.gain(i, j)
            value = gain.drop - (columns[i].size + columns[j].size) * cost
            if best is None or value > best[0]:
                best = (value, tuple(zip((columns[i], columns[j]), gain.theta)))
        double[one, two] = best
    return single, double


def _best_use(table, one, two):
    """Best of a pair at one joint: ``score, (first or None, second or None)``."""
    single, double = table
    uses = [(0.0, (None, None))]
    if one in single:
        uses.append((single[one][0], (single[one][1][0], None)))
    if two in single:
        uses.append((single[two][0], (None, single[two][1][0])))
    if (one, two) in double:
        score, both = double[one, two]
        uses.append((score - LEAST, both))
    return max(uses, key=lambda use: use[0])


def _pair_member(chosen, i):
    best = {k: use[1][i] for k, use in enumerate(chosen) if use[1][i] is not None}
    if not best:
        return None
    cause = next(iter(best.values()))[0].cause
    joints = tuple(best)
    if cause.shared:
        strongest = max(best, key=lambda k: chosen[k][0])
        joints, best = tuple(range(len(chosen))), {k: best[strongest]
                                                   for k in range(len(chosen))}
    return _member(cause, joints, best)


def _compatible(one, two):
    """Whether two members are two: names differ, neither is in the other, one transmission."""
    loose = {"joint_elasticity", "backlash"}
    names = {one.cause.name, two.cause.name}
    nested = one.cause.name in two.cause.without or two.cause.name in one.cause.without
    return len(names) == 2 and not nested and not names <= loose


def extensions(first, candidates):
    """Candidates that add a cause to the members of a fit."""
    kept = fitted_members(first.hypothesis)
    for candidate in candidates:
        (more,) = candidate.members
        beside = [member for member in kept if member.cause.name not in more.cause.without]
        for member in kept:
            if member not in beside:
                more = _holding(more, member)
        if all(_compatible(member, more) for member in beside):
            yield Candidate((*beside, more), candidate.score, first)


def _holding(more, simpler):
    """Member of a cause that is a simpler one, and more: with the level of both."""
    level = more.values["level"] + simpler.values["level"]
    return dataclasses.replace(more, joints=tuple(sorted({*more.joints, *simpler.joints})),
                               values={**more.values, "level": level})


def fitted_members(at):
    """Members of a fitted hypothesis with the fitted numbers."""
    return tuple(dataclasses.replace(member, values={
        number.name: at.values[f"{member.name}.{number.name}"]
        for number in member.cause.numbers}) for member in at.members)
