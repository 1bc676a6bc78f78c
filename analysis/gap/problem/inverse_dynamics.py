"""Inverse-dynamics least squares: where to start when no datasheet states the joint model."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.linear_filters import low_pass
from clie_blocks.robot_loop.links import Links, coupling_torque, gravity_torque

SMOOTHING_CORNER = 20.0  # Hz of the zero-phase low-pass before differentiation
_WITH_ROTOR = 1.05  # of the inertia of links: the least with a rotor
# Of the largest velocity of a log, below which a velocity is rounding: its sign is arbitrary.
ROUNDED_VELOCITY = 1e-9


def inverse_dynamics_model(logs: Sequence[Log], period: float, links: Links, ratio: np.ndarray,
                           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inertia, damping and load of each joint from smoothed motion and commands, (n,) each.

    What stated links take of the commands beyond a constant inertia is left out, and an inertia is
    at least that of the links: without rotors of their own they would run away.
    """
    motions = [_smooth(log, period, links, ratio) for log in logs]
    coefficients = [_joint_coefficients(motions, k) for k in range(links.n)]
    inertia, damping, load, _ = np.array(coefficients).T
    least = np.maximum(1e-9, _WITH_ROTOR * links.diagonal / ratio)
    return np.maximum(np.abs(inertia), least), np.maximum(damping, 0.0), load


def _smooth(log: Log, period: float, links: Links, ratio: np.ndarray,
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocities, accelerations, and commands without what the links take, (N, n) each."""
    corner, rate = min(SMOOTHING_CORNER, 0.2 / period), 1.0 / period
    q, u = (low_pass(x, 4, corner, rate) for x in (log.q, log.supplied_u))
    dq = np.gradient(q, period, axis=0)
    ddq = np.gradient(dq, period, axis=0)
    if links.has_gravity:
        u = u - gravity_torque(links, q) / ratio
    if links.has_coupling:
        u = u - coupling_torque(links, q, dq, ddq) / ratio
    return dq, ddq, u


def _joint_coefficients(motions: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], k: int,
                        ) -> np.ndarray:
    """Inertia, damping, load and dry friction of joint k."""
    dq, ddq, u = (np.concatenate([x[:, k] for x in signal]) for signal in zip(*motions))
    regressors = np.stack([ddq, dq, np.ones_like(dq), _direction(dq)], axis=1)
    return np.linalg.lstsq(regressors, u, rcond=None)[0]


def _direction(dq: np.ndarray) -> np.ndarray:
    """Sign of a velocity, 0 at rest."""
    return np.where(np.abs(dq) > ROUNDED_VELOCITY * np.abs(dq).max(), np.sign(dq), 0.0)
