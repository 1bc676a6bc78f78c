"""Sparse regression of the residual torque (SINDy, by sequentially thresholded least squares).

What the datasheet's model leaves of the measured torque is regressed on the whole library at once;
terms that contribute less than a threshold are dropped, and the rest is fitted again.  The
threshold runs over a path; BIC weighs the models on it (Brunton, Proctor, Kutz 2016; model choice
along the path: Mangan et al. 2017).
"""

import numpy as np

from clie_blocks.analysis.blind.baselines import motion
from clie_blocks.analysis.blind.baselines.inverse_dynamics import (
    alone,
    base_columns,
    probes,
    regressed,
)
from clie_blocks.analysis.blind.baselines.weighing import answer
from clie_blocks.analysis.gap.problem import problem as state_problem

THRESHOLDS = np.geomspace(0.02, 2.0, 15)  # of the residual's RMS
ROUNDS = 10
MOST = 4  # terms of a model that is worth a name


def sparse_regression(robot, records):
    """Diagnose a robot by sparse regression of what its datasheet leaves.

    Parameters
    ----------
    robot : Robot
        What is known.
    records : list of Record
        Its logs; the last one only judges.

    """
    problem = state_problem(robot, records)
    found = motion.motions(problem, problem.fit)
    target = motion.filtered(problem, [motion.net_command(m) for m in found])
    base, groups = base_columns(problem, found), probes(problem, found)
    looks = [alone(problem, target, base, group)[1] for group in groups.values()]
    models = {(): regressed(problem, target, base, ())}
    for threshold in THRESHOLDS:
        kept = tuple(_kept(problem, target, base, looks, threshold))
        if len(kept) <= MOST:
            models.setdefault(kept, regressed(problem, target, base, [looks[i] for i in kept]))
    return answer(problem, list(models.values()))


def _kept(problem, target, base, looks, threshold):
    """Causes that survive the thresholding at some joint."""
    alive = set()
    for k in range(problem.n):
        residual = target[:, k] - _datasheet(problem, k) @ base[:, :, k]
        blocks = [base[:, :, k], *(look[2][:, :, k] for look in looks)]
        alive |= _thresholded(residual, blocks, threshold)
    return sorted(alive)


def _datasheet(problem, k):
    nominal = problem.nominal
    return np.array([nominal.inertia[k], nominal.damping[k], nominal.load[k]])


def _thresholded(residual, blocks, threshold):
    """Positions of the causes whose contribution stays above the threshold; the base stays."""
    matrix = np.concatenate(blocks).T
    owner = np.repeat(np.arange(len(blocks)) - 1, [len(block) for block in blocks])
    scale = np.sqrt((matrix**2).mean(axis=0)) + 1e-300
    least = threshold * np.sqrt(np.mean(residual**2))
    alive = np.ones(len(owner), bool)
    for _ in range(ROUNDS):
        theta = np.zeros(len(owner))
        theta[alive] = np.linalg.lstsq(matrix[:, alive] / scale[alive], residual, rcond=1e-8)[0]
        after = (np.abs(theta) >= least) | (owner < 0)
        if (after == alive).all():
            break
        alive = after
    return {int(i) for i in owner[alive] if i >= 0}
