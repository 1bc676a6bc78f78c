"""From a screening to hypotheses worth a full fit: single causes, and pairs."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.hypothesis import Member
from clie_blocks.analysis.gap.screen import gain
from clie_blocks.analysis.gap.search import faults, periodic, residuals

WORTH = 0.03  # share of a cause's gain that a further joint must add


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """Some causes with numbers to start from, and what they are expected to explain.

    Parameters
    ----------
    members : tuple of Member
        The causes.
    score : float
        Expected drop of chi^2 less what its numbers cost.

    """

    members: tuple
    score: float

    @property
    def names(self):
        """Names of the causes."""
        return tuple(member.cause.name for member in self.members)


def singles(found, bench, base):
    """Return one candidate per cause (and variant), best first.

    Parameters
    ----------
    found : Screen
        The screening.
    bench : Bench
        Whitening.
    base : Fit
        What was screened around.

    """
    price = np.log(found.samples * bench.problem.n)
    by_cause = {}
    for column in found.columns:
        by_cause.setdefault(column.cause.key, []).append(column)
    result = []
    for columns in by_cause.values():
        make = _shared if columns[0].cause.shared else _per_joint
        result.append(make(columns, found, price))
    errors = residuals(bench, base)
    for member, drop in [periodic(bench, base, errors), *faults(bench, base, errors)]:
        result.append(_searched(member, drop, price, len(bench.problem.fit)))
    return sorted((c for c in result if c is not None), key=lambda c: -c.score)


def _shared(columns, found, price):
    """One set of numbers for all joints: the joints' regressions are stacked."""
    best = None
    n = len(found.target)
    for probe in {column.probe for column in columns}:
        parts = sorted((c for c in columns if c.probe == probe), key=lambda c: c.joint)
        stacked = dataclasses.replace(parts[0], data=np.concatenate([c.data for c in parts]))
        result = gain([stacked], np.concatenate(found.target))
        score = result.drop - parts[0].size * price
        if best is None or score > best[0]:
            best = (score, parts[0], result.theta[0])
    score, column, theta = best
    values = dict(column.member.values)
    for name, coefficient in zip(column.amplitudes, theta):
        values[name] = coefficient * values[name]
    return Candidate((Member(column.cause, tuple(range(n)), values, column.member.sizes),), score)


def _per_joint(columns, found, price):
    best = {}
    for column in columns:
        result = gain([column], found.target[column.joint])
        score = result.drop - column.size * price
        if column.joint not in best or score > best[column.joint][0]:
            best[column.joint] = (score, column, result.theta[0])
    top = max(score for score, _, _ in best.values())
    joints = tuple(sorted(k for k, (score, _, _) in best.items()
                          if score == top or score > max(10.0, WORTH * top)))
    score = sum(best[k][0] for k in joints)
    return Candidate((_assembled(columns[0].cause, joints, best),), score)


def _assembled(cause, joints, best):
    """Member whose numbers at each joint are those of the joint's best probe."""
    first = best[joints[0]][1]
    values = {name: np.array(value, float) for name, value in first.member.values.items()}
    for k in joints:
        _, column, theta = best[k]
        for name in values:
            values[name][..., k] = column.member.values[name][..., k]
        for name, coefficient in zip(column.amplitudes, theta):
            values[name][..., k] *= coefficient
    return Member(cause, joints, values, first.member.sizes)


def _searched(member, drop, price, logs):
    size = 2 * logs + 1 if member.cause.name == "periodic_disturbance" else logs + 1
    score = drop - size * price
    if member.cause.shared:
        return Candidate((member,), float(drop.sum() - size * price))
    top = score.max()
    joints = tuple(k for k in range(len(drop))
                   if score[k] == top or score[k] > max(10.0, WORTH * top))
    return Candidate((dataclasses.replace(member, joints=joints),), float(score[list(joints)].sum()))
