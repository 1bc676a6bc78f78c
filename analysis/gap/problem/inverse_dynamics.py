"""Inverse-dynamics least squares: where to start when no datasheet states the joint model."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.linear_filters import low_pass

CORNER = 20.0  # Hz of the zero-phase low-pass before differentiation


def inverse_dynamics_model(logs: Sequence[Log], period: float,
                           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inertia, damping and offset of each joint from smoothed motion and commands."""
    corner, rate = min(CORNER, 0.2 / period), 1.0 / period
    found = []
    for k in range(logs[0].q.shape[1]):
        rows, right = [], []
        for log in logs:
            q, u = (low_pass(x[:, k], 4, corner, rate) for x in (log.q, log.u))
            dq = np.gradient(q, period)
            ddq = np.gradient(dq, period)
            rows.append(np.stack([ddq, dq, np.ones_like(q), np.sign(dq)], axis=1))
            right.append(u)
        found.append(np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0])
    inertia, damping, load, _ = np.array(found).T
    return np.maximum(np.abs(inertia), 1e-9), np.maximum(damping, 0.0), load
