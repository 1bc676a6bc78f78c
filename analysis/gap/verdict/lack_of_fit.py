"""What a hypothesis leaves, against a torque that is free to depend on pose, speed and load.

Such a torque holds no physics: it is a sum of bumps.  If it explains the leftover on logs that it
was not fitted to, something is there that the hypothesis does not hold.
"""

import numpy as np

from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.residual.noise import decimated, decimation, whiten
from clie_blocks.analysis.gap.residual.sensitivity import decimated_filter, torque_sensitivity
from clie_blocks.linear_filters import lfilter

BUMPS = 10  # over the range of a signal
RIDGES = 1e-6, 1e-4, 1e-2, 0.1  # on columns of size one
FOLDS = 4  # parts of each log
SLOW, FAST = 0.05, 5.0  # of the typical speed: what counts as turning round; range of the bumps


def excess_with_free_torque(found, bench):
    """Return the excess that would be left with a free torque beside a fitted hypothesis.

    Parameters
    ----------
    found : Fit
        The hypothesis.
    bench : Bench
        Whitening.

    Returns
    -------
    float
        Excess per sample of one joint; the free torque is judged on logs (or parts of the only
        one) that it was not fitted to.

    """
    problem = bench.problem
    errors = [bench.whitened(found.hypothesis.error(j), j) for j in range(len(problem.logs))]
    gain = sum(_gain([(_columns(found, bench, j, k), errors[j][k])
                      for j in range(len(problem.logs))]) for k in range(problem.n))
    return excess(found) - gain / (found.samples.sum() / problem.n)


def _gain(parts):
    """Drop of chi^2 on each part by columns fitted to the others, where it is one, summed."""
    parts = [part for data, error in parts
             for part in zip(np.array_split(data, FOLDS), np.array_split(error, FOLDS))]
    scale = np.sqrt(sum((data**2).sum(axis=0) for data, _ in parts)) + 1e-12
    grams = [(data / scale).T @ (data / scale) for data, _ in parts]
    rights = [(data / scale).T @ error for data, error in parts]
    best = 0.0
    for ridge in RIDGES:
        drop = 0.0
        for gram, right in zip(grams, rights):
            rest = sum(grams) - gram + ridge * np.eye(len(right))
            theta = np.linalg.solve(rest, sum(rights) - right)
            drop += max(float(2 * theta @ right - theta @ gram @ theta), 0.0)
        best = max(best, drop)
    return best


def _columns(found, bench, j, k):
    """Whitened responses of joint k in log j to unit torques, one per bump."""
    problem, values = bench.problem, found.hypothesis.values
    b, a = decimated_filter(*torque_sensitivity(problem.law, k, values["inertia"][k],
                                      values["damping"][k]), decimation(problem.period))
    moved = lfilter(b, a, decimated(_torques(problem, j, k), problem.period))
    return bench.projected(whiten(moved, bench.noises[k].whitener), j, k)


def _torques(problem, j, k):
    """Bumps over pose, with the way and the speed of the motion; speed; load; lines."""
    positions = [log.q[:, k] - log.dither[:, k] for log in problem.logs]
    rates = [np.gradient(q, problem.period) for q in positions]
    least, most = (side(np.concatenate(positions)) for side in (np.min, np.max))
    typical = np.sqrt(np.mean(np.concatenate(rates) ** 2)) + 1e-12
    peak = max(np.abs(log.u[:, k]).max() for log in problem.logs) + 1e-12
    rate = rates[j][:, None] / typical
    way = np.tanh(rate / SLOW)
    pose = _bumps((positions[j] - least) / (most - least + 1e-12))
    speed = _bumps(np.clip(rate[:, 0] / FAST + 0.5, 0.0, 1.0))
    u = problem.logs[j].u
    load = _bumps(np.abs(u[:, k]) / peak)
    lines = np.stack([positions[j], rates[j], u[:, k], u[:, k] * np.abs(u[:, k]) / peak,
                      u[:, k] * np.abs(u).sum(axis=1) / peak], axis=1)
    return np.concatenate([pose, pose * way, pose * rate, speed, load * way, lines], axis=1)


def _bumps(share):
    """Triangular bumps that sum to one over the range 0..1, shape (N, bumps)."""
    at = share[:, None] * (BUMPS - 1) - np.arange(BUMPS)
    return np.maximum(1.0 - np.abs(at), 0.0)
