"""Instants at which commands are held, sought anew around a fitted hypothesis.

They decide from sample to sample whether a command is held, so that no fit can move them: they
are simulated side by side, more and more finely.
"""

import operator
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    Values,
    chi2_by_joint,
)
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

_SIDE_BY_SIDE = 15  # simulations
_REACHES = (0.5, 16), (0.25, 8), (0.1, 8), (0.02, 8)
"""Share of the time of a hold by which its start may be off, and how many starts are tried there,
with as many intervals."""


def refit_holds(fitted: Fit, member: Member, residuals: ResidualModel) -> Values:
    """Values with the interval and the phase in each log at which the holds leave least.

    They are as close to them as the time allows.  Joints whose holds explain little are left as
    they are.
    """
    hypothesis = fitted.hypothesis
    joints = _joints_that_count(hypothesis, member, residuals)
    for reach, count in _REACHES if joints else ():
        if residuals.is_out_of_time:
            break
        for k in joints:
            hypothesis = _with_best_length(hypothesis, member, residuals, reach, k)
            hypothesis = _with_best_times(hypothesis, member, residuals, reach, count, k)
    return hypothesis.values


def _joints_that_count(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                       ) -> list[int]:
    """Joints without whose holds clearly more would be left."""
    values, hold = hypothesis.values, f"{member.name}.hold"
    without = [{**values, hold: np.where(np.arange(len(values[hold])) == k, 0.0, values[hold])}
               for k in member.joints]
    left = np.sum([_left_in_log(hypothesis, [values, *without], residuals, j)
                   for j in range(len(residuals.problem.fit))], axis=0)
    kept = 1.0 - residuals.method.search.refined_share
    return [k for k, more in zip(member.joints, left[1:]) if left[0] < kept * more]


def _with_best_length(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                      reach: float, k: int) -> Hypothesis:
    """Holds of another length, that end later or begin earlier."""
    values = hypothesis.values
    hold, interval, phase = (f"{member.name}.{name}" for name in ("hold", "interval", "phase"))
    tried = []
    for more in values[hold][k] * reach * np.linspace(-1.0, 1.0, _SIDE_BY_SIDE):
        for earlier in (0.0, more):
            holds, phases = values[hold].copy(), values[phase].copy()
            holds[k] += more
            phases[:, k] = (phases[:, k] + earlier / values[interval][k]) % 1.0
            tried.append({**values, hold: holds, phase: phases})
    return _best(hypothesis, tried, residuals)


def _with_best_times(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                     reach: float, count: int, k: int) -> Hypothesis:
    """Holds of another interval, that begin earlier or later in each log.

    An interval and a phase that are both a little wrong may match a part of a log: neither alone
    is better then, so they are tried together, in the fit logs, which decide on the interval.
    """
    problem, values = residuals.problem, hypothesis.values
    hold, interval, phase = (f"{member.name}.{name}" for name in ("hold", "interval", "phase"))
    middle = np.array([len(log) * problem.period / 2 for log in problem.logs])
    length = values[interval][k]
    off = reach * values[hold][k] * np.arange(-count // 2, count // 2) / (count // 2)

    def with_best_phases(begun: Values, logs: Sequence[int]) -> tuple[float, Values]:
        """What the holds leave in some logs with the phases that leave least, and these."""
        phases, longer, cost = begun[phase].copy(), begun[interval][k], 0.0
        of_middle = values[phase][:, k] + middle / length - middle / longer
        for j in logs:
            some = np.repeat(phases[None], count, axis=0)
            some[:, j, k] = (of_middle[j] + off / longer) % 1.0
            left = _left_in_log(hypothesis, [{**begun, phase: one} for one in some], residuals, j)
            phases[j, k] = some[int(np.argmin(left)), j, k]
            cost += float(left.min())
        return cost, {**begun, phase: phases}

    fit_logs, logs = len(problem.fit), len(problem.logs)
    tried = []
    for longer in length * (1.0 + off / middle.max()):  # by so much at the ends of the longest log
        intervals = values[interval].copy()
        intervals[k] = longer
        tried.append(with_best_phases({**values, interval: intervals}, range(fit_logs)))
    _, best = min(tried, key=operator.itemgetter(0))
    return hypothesis.with_values(with_best_phases(best, range(fit_logs, logs))[1])


def _best(hypothesis: Hypothesis, tried: list[Values], residuals: ResidualModel) -> Hypothesis:
    left = np.sum([_left_in_log(hypothesis, tried, residuals, j)
                   for j in range(len(residuals.problem.fit))], axis=0)
    return hypothesis.with_values(tried[int(np.argmin(left))])


def _left_in_log(hypothesis: Hypothesis, tried: list[Values], residuals: ResidualModel, j: int,
                 ) -> np.ndarray:
    """Chi^2 that each of some sets of values leaves in log j."""
    variants = [hypothesis.with_values(values) for values in tried]
    return np.sum(chi2_by_joint(variants, residuals, j), axis=0)
