"""Inverse-dynamics least squares: where to start when no datasheet states the joint model."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.linear_filters import low_pass

SMOOTHING_CORNER = 20.0  # Hz of the zero-phase low-pass before differentiation
# Of the largest velocity of a log, below which a velocity is rounding: its sign is arbitrary.
ROUNDED_VELOCITY = 1e-9


def inverse_dynamics_model(logs: Sequence[Log], period: float,
                           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inertia, damping and load of each joint from smoothed motion and commands, (n,) each."""
    coefficients = [_joint_coefficients(logs, k, period) for k in range(logs[0].q.shape[1])]
    inertia, damping, load, _ = np.array(coefficients).T
    return np.maximum(np.abs(inertia), 1e-9), np.maximum(damping, 0.0), load


def _joint_coefficients(logs: Sequence[Log], k: int, period: float) -> np.ndarray:
    """Inertia, damping, load and dry friction of joint k."""
    corner, rate = min(SMOOTHING_CORNER, 0.2 / period), 1.0 / period
    regressors, commands = [], []
    for log in logs:
        q, u = (low_pass(x[:, k], 4, corner, rate) for x in (log.q, log.supplied_u))
        dq = np.gradient(q, period)
        ddq = np.gradient(dq, period)
        regressors.append(np.stack([ddq, dq, np.ones_like(q), _direction(dq)], axis=1))
        commands.append(u)
    return np.linalg.lstsq(np.concatenate(regressors), np.concatenate(commands), rcond=None)[0]


def _direction(dq: np.ndarray) -> np.ndarray:
    """Sign of a velocity, 0 at rest."""
    return np.where(np.abs(dq) > ROUNDED_VELOCITY * np.abs(dq).max(), np.sign(dq), 0.0)
