"""What a hypothesis leaves, against a torque that is free to depend on pose, speed and load.

Such a torque holds no physics: it is a sum of bumps.  If it predicts what is left on logs that it
was not fitted to, the robot holds something that the hypothesis does not.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.ridge import ridge_cv
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import whiten
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.theory.sampled_loop import decimated_filter
from clie_blocks.linear_filters import lfilter


def excess_with_free_torque(fit: Fit, residuals: ResidualModel) -> float:
    """Return the excess that a fitted hypothesis would leave with a free torque added.

    It is per sample of one joint; the free torque is validated on logs (or parts of the only
    one) that it was not fitted to.
    """
    problem, method = residuals.problem, residuals.method.verdict
    logs = range(len(problem.logs))
    errors = [residuals.whitened(fit.hypothesis.error(j), j) for j in logs]
    gain = sum(_gain([(_columns(fit, residuals, j, k), errors[j][k]) for j in logs],
                     problem.runs, method) for k in range(problem.n))
    return fit.excess - gain / (fit.samples.sum() / problem.n)


def _gain(parts: list[tuple[np.ndarray, np.ndarray]], runs: Sequence[int],
          method: VerdictMethod) -> float:
    """Drop of chi^2 on each part, where it is one, by columns fitted to the others, summed.

    Each part has columns (N, c) and an error (N,), and its run: what two encoders saw at once is
    one part.
    """
    folds = [fold for run in dict.fromkeys(runs)
             for fold in _folds([part for part, own in zip(parts, runs) if own == run],
                                method.free_torque_folds)]
    scale = np.sqrt(sum((columns**2).sum(axis=0) for columns, _ in folds)) + 1e-12
    grams = np.array([(columns / scale).T @ (columns / scale) for columns, _ in folds])
    rights = np.array([(columns / scale).T @ error for columns, error in folds])
    return _gained(ridge_cv(grams, rights, method.free_torque_ridges, _gained).drops)


def _folds(views: Sequence[tuple[np.ndarray, np.ndarray]], count: int,
           ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Columns and errors of all views of one run, piece by piece."""
    split = [[np.array_split(signal, count) for signal in view] for view in views]
    for i in range(count):
        columns, errors = zip(*((of_columns[i], of_error[i]) for of_columns, of_error in split))
        yield np.concatenate(columns), np.concatenate(errors)


def _gained(drops: np.ndarray) -> float:
    return float(np.maximum(drops, 0.0).sum())


def _columns(fit: Fit, residuals: ResidualModel, j: int, k: int) -> np.ndarray:
    """Whitened responses of joint k in log j to unit torques, one per bump, shape (N, columns)."""
    problem, values = residuals.problem, fit.hypothesis.values
    rows = residuals.rows(j)
    b, a = decimated_filter(
        *problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k]),
        rows.ticks, rows.stride)
    torques = _torques(problem, j, k, residuals.method.verdict)
    moved = lfilter(b, a, rows.of_ticks(torques))
    return residuals.without_initial_response(
        whiten(moved, residuals.noise(j, k).whitener), j, k)


def _torques(problem: Problem, j: int, k: int, method: VerdictMethod) -> np.ndarray:
    """Bumps over pose, alone, with the direction and with the speed; speed; load; lines."""
    positions = [log.q[:, k] - log.dither[:, k] for log in problem.logs]
    rates = [np.gradient(q, problem.period) for q in positions]
    least, most = (side(np.concatenate(positions)) for side in (np.min, np.max))
    typical = np.sqrt(np.mean(np.concatenate(rates) ** 2)) + 1e-12
    peak = max(np.abs(log.u[:, k]).max() for log in problem.logs) + 1e-12
    count, fast = method.free_torque_bumps, method.free_torque_speed_range
    rate = rates[j][:, None] / typical
    direction = np.tanh(rate / method.free_torque_reversal_speed)
    pose = _bumps((positions[j] - least) / (most - least + 1e-12), count)
    speed = _bumps(np.clip(rate[:, 0] / fast + 0.5, 0.0, 1.0), count)
    u = problem.logs[j].u
    load = _bumps(np.abs(u[:, k]) / peak, count)
    lines = np.stack([positions[j], rates[j], u[:, k], u[:, k] * np.abs(u[:, k]) / peak,
                      u[:, k] * np.abs(u).sum(axis=1) / peak], axis=1)
    return np.concatenate([pose, pose * direction, pose * rate, speed, load * direction, lines],
                          axis=1)


def _bumps(share: np.ndarray, count: int) -> np.ndarray:
    """Triangular bumps that sum to one over the range 0..1, shape (N, count)."""
    distance = share[:, None] * (count - 1) - np.arange(count)
    return np.maximum(1.0 - np.abs(distance), 0.0)
