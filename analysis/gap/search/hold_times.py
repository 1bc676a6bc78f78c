"""Instants at which commands are held, sought anew around a fitted hypothesis.

They decide from sample to sample whether a command is held, so that no fit can move them: they
are simulated side by side, more and more finely.
"""

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
_REACHES = 0.5, 0.25, 0.5, 0.1, 0.02  # of the time of a hold, by which its start may be off


def refit_holds(fitted: Fit, member: Member, residuals: ResidualModel) -> Values:
    """Values with the interval and the phase in each log at which the holds leave least.

    They are as close to them as the time allows.
    """
    hypothesis = fitted.hypothesis
    for reach in _REACHES:
        if residuals.is_out_of_time:
            break
        for k in member.joints:
            hypothesis = _with_best_length(hypothesis, member, residuals, reach, k)
            hypothesis = _with_best_interval(hypothesis, member, residuals, reach, k)
            for j in range(len(residuals.problem.logs)):
                hypothesis = _with_best_phase(hypothesis, member, residuals, reach, j, k)
    return hypothesis.values


def _with_best_length(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                      reach: float, k: int) -> Hypothesis:
    values, hold = hypothesis.values, f"{member.name}.hold"
    tried = []
    for share in 1.0 + reach * np.linspace(-1.0, 1.0, _SIDE_BY_SIDE):
        holds = values[hold].copy()
        holds[k] *= share
        tried.append({**values, hold: holds})
    return _best(hypothesis, tried, residuals, range(len(residuals.problem.fit)))


def _with_best_interval(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                        reach: float, k: int) -> Hypothesis:
    """Holds that begin earlier or later by a reach at the ends of a log, not in its middle."""
    problem, values = residuals.problem, hypothesis.values
    hold, interval, phase = (f"{member.name}.{name}" for name in ("hold", "interval", "phase"))
    middle = np.array([len(log) * problem.period / 2 for log in problem.logs])
    length = values[interval][k]
    off = reach * values[hold][k] * np.linspace(-1.0, 1.0, _SIDE_BY_SIDE)
    tried = []
    for longer in length * (1.0 + off / middle.max()):
        phases, intervals = values[phase].copy(), values[interval].copy()
        phases[:, k] = (phases[:, k] + middle / length - middle / longer) % 1.0
        intervals[k] = longer
        tried.append({**values, phase: phases, interval: intervals})
    return _best(hypothesis, tried, residuals, range(len(problem.fit)))


def _with_best_phase(hypothesis: Hypothesis, member: Member, residuals: ResidualModel,
                     reach: float, j: int, k: int) -> Hypothesis:
    values = hypothesis.values
    hold, interval, phase = (f"{member.name}.{name}" for name in ("hold", "interval", "phase"))
    off = reach * values[hold][k] / values[interval][k] * np.linspace(-1.0, 1.0, _SIDE_BY_SIDE)
    tried = []
    for later in off:
        phases = values[phase].copy()
        phases[j, k] = (phases[j, k] + later) % 1.0
        tried.append({**values, phase: phases})
    return _best(hypothesis, tried, residuals, (j,))


def _best(hypothesis: Hypothesis, tried: list[Values], residuals: ResidualModel,
          logs: range | tuple[int, ...]) -> Hypothesis:
    variants = [hypothesis.with_values(values) for values in tried]
    left = sum(sum(chi2_by_joint(variants, residuals, j)) for j in logs)
    return variants[int(np.argmin(left))]
