"""Sparse regression of the residual torque, as SINDy does, by stepwise elimination.

What the datasheet's model leaves of the measured torque is regressed on the whole library at once;
the term that the fit misses least is dropped, one after the other, and BIC weighs the models on
that path (stepwise sparse regressor: Boninsegna, Nueske, Clementi 2018; model choice along the
path: Mangan, Kutz, Brunton, Proctor 2017).  Hard thresholds instead drop the right term together
with its look-alikes: over a short travel the columns of a robot are nearly parallel.  The library
holds each shape once: friction that contains plain dry friction enters with what it adds to it.
"""

import numpy as np

from clie_blocks.analysis.blind.comparison.baselines import smoothed_motion
from clie_blocks.analysis.blind.comparison.baselines.inverse_dynamics import (
    alone,
    base_columns,
    probes,
    regressed,
)
from clie_blocks.analysis.blind.comparison.baselines.model_selection import answer

REDUNDANT = ("asymmetric_coulomb",)  # dry friction and an offset, which the library holds


def sparse_regression(problem):
    """Diagnose a robot by sparse regression of what its datasheet leaves."""
    found = smoothed_motion.motions(problem, problem.fit)
    target = smoothed_motion.filtered(problem, [smoothed_motion.net_command(m) for m in found])
    base, groups = base_columns(problem, found), probes(problem, found)
    looks = [alone(problem, target, base, group)[1] for key, group in groups.items()
             if key not in REDUNDANT]
    paths = [_path(target[:, k], base[:, :, k], [_added(look)[:, :, k] for look in looks])
             for k in range(problem.n)]
    models = [regressed(problem, target, base, looks,
                        lambda k, kept=kept: [(), _largest(kept[k], looks)])
              for kept in zip(*paths)]
    distinct = {model.names: model for model in sorted(models, key=lambda m: -m.bic)}
    return answer(problem, list(distinct.values()))


def _path(target, base, blocks):
    """Positions of the causes kept, from all of them to none, by least loss of fit."""
    kept = list(range(len(blocks)))
    path = [tuple(kept)]
    while kept:
        losses = [_left(target, [base, *(blocks[i] for i in kept if i != out)]) for out in kept]
        kept.pop(int(np.argmin(losses)))
        path.append(tuple(kept))
    return path


def _left(target, blocks):
    matrix = np.concatenate(blocks).T
    left = target - matrix @ np.linalg.lstsq(matrix, target, rcond=1e-8)[0]
    return float(left @ left)


def _added(look):
    """Columns of a cause that the simpler cause within it does not have."""
    cause, probe, columns = look
    names = [cause.without[1]] if cause.without else probe.amplitudes
    return np.stack([column for name, column in zip(probe.amplitudes, columns)
                     if name in names]) if probe.amplitudes else columns


def _largest(kept, looks):
    """Causes that were kept, without those that are inside another one."""
    inside = {looks[i][0].without[0] for i in kept if looks[i][0].without}
    return tuple(i for i in kept if looks[i][0].name not in inside)
