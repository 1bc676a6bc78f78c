"""The Lyapunov functions (14) and (A.1), their derivatives, and their invariant level sets.

Vectors have shape (n,) or, along a run, (n, samples); the result has shape () or (samples,).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


def lyapunov_pd(dq: np.ndarray, q_err: np.ndarray, w: ArrayLike, b: ArrayLike, kp: ArrayLike,
                ) -> np.ndarray:
    """Lyapunov function of the PD loop, eq. (14), with ``w = a + b kd``."""
    w, b, kp = _columns(dq, w, b, kp)
    return 0.5 * np.sum(dq**2 + (w**2 / 2 + b * kp) * q_err**2 - w * q_err * dq, axis=0)


def lyapunov_pd_rate(dq: np.ndarray, q_err: np.ndarray, eta: np.ndarray, w: ArrayLike,
                     b: ArrayLike, kp: ArrayLike) -> np.ndarray:
    """Derivative of (14) along (12), eq. (16), with ``eta = b pe - d``."""
    w, b, kp = _columns(dq, w, b, kp)
    return np.sum(-w * dq**2 / 2 - w * b * kp * q_err**2 / 2 + dq * eta - w * q_err * eta / 2,
                  axis=0)


def lyapunov_pd_matrices(w: ArrayLike, b: ArrayLike, kp: ArrayLike) -> np.ndarray:
    """Matrices P_k of ``V = sum_k x_k^T P_k x_k / 2``, (14), x_k = (dq_k, q_err_k): (n, 2, 2)."""
    w, b, kp = np.atleast_1d(w, b, kp)
    return _symmetric(np.ones_like(w), -w / 2, w**2 / 2 + b * kp)


def lyapunov_clie(e: np.ndarray, de: np.ndarray, theta_err: np.ndarray, gamma: ArrayLike,
                  a_bar: ArrayLike, b_bar: ArrayLike, kp: ArrayLike, kd: ArrayLike) -> np.ndarray:
    """Lyapunov function of the identification loop, eq. (A.1); `gamma` a number or (3n,)."""
    a_bar, b_bar, kp, kd = _columns(e, a_bar, b_bar, kp, kd)
    e_u = kp * e + kd * de
    stiffness = b_bar * kd**2 / kp + kp * (kd / kp * a_bar - 1)
    of_estimates = np.sum(theta_err**2 / _columns(theta_err, gamma)[0], axis=0)
    return 0.5 * (np.sum(e_u**2 / kp + stiffness * e**2, axis=0) + of_estimates)


def lyapunov_clie_rate(e: np.ndarray, de: np.ndarray, eps: np.ndarray, a_bar: ArrayLike,
                       b_bar: ArrayLike, kp: ArrayLike, kd: ArrayLike) -> np.ndarray:
    """Derivative of (A.1) along (29) under (27), eq. (A.4) before its estimates."""
    a_bar, b_bar, kp, kd = _columns(e, a_bar, b_bar, kp, kd)
    k_bar = kd / kp * a_bar - 1
    work = (kp * e + kd * de) * kd / kp * eps
    return np.sum(-kd * b_bar * e**2 - kd * k_bar * de**2 + work, axis=0)


def lyapunov_clie_matrices(a_bar: ArrayLike, b_bar: ArrayLike, kp: ArrayLike, kd: ArrayLike,
                           ) -> np.ndarray:
    """Matrices of the part of (A.1) in ``(e_k, de_k)``, without the estimates: (n, 2, 2)."""
    a_bar, b_bar, kp, kd = np.atleast_1d(a_bar, b_bar, kp, kd)
    stiffness = b_bar * kd**2 / kp + kp * (kd / kp * a_bar - 1)
    return _symmetric(kp + stiffness, kd, kd**2 / kp)


@dataclass(frozen=True)
class LevelSet:
    """The smallest set ``V <= level`` that contains a ball, and the ball that contains the set.

    Parameters
    ----------
    level : float
        Value of V on its surface.
    inner, outer : float
        Radii of the ball inside and of the ball around it.

    """

    level: float
    inner: float
    outer: float

    @property
    def blow_up(self) -> float:
        """Factor from the inner radius to the outer, sqrt(lambda_max / lambda_min) of V."""
        return self.outer / self.inner


def level_set_around(matrices: np.ndarray, radius: float) -> LevelSet:
    """Level set of ``V = sum_k x_k^T P_k x_k / 2`` that contains the ball of a radius.

    Outside the ball V falls, so that a trajectory enters the level set and stays; the ball itself
    it may leave again, because V, not the distance, is what falls.

    Parameters
    ----------
    matrices : ndarray, shape (n, m, m)
        The matrices P_k, positive definite.
    radius : float
        Radius of the ball.

    Returns
    -------
    LevelSet
        Its outer radius is the ultimate bound that holds.

    """
    eigenvalues = np.linalg.eigvalsh(matrices)
    largest, smallest = np.max(eigenvalues), np.min(eigenvalues)
    return LevelSet(float(largest * radius**2 / 2), float(radius),
                    float(radius * np.sqrt(largest / smallest)))


def error_bound(matrices: np.ndarray, gamma: ArrayLike, theta_err: ArrayLike) -> float:
    """Bound on ||E|| for all time from a start at E = 0, matched case: ``V`` never rises.

    Parameters
    ----------
    matrices : ndarray, shape (n, 2, 2)
        Those of `lyapunov_clie_matrices`.
    gamma : float or array_like, shape (3n,)
        Adaptation gain.
    theta_err : array_like, shape (3n,)
        Parametric error at the start.

    Returns
    -------
    float
        Radius in the space of ``E = (e, de)``.

    """
    start = np.sum(np.asarray(theta_err) ** 2 / gamma) / 2
    return float(np.sqrt(2 * start / np.min(np.linalg.eigvalsh(matrices))))


def _symmetric(first: np.ndarray, cross: np.ndarray, last: np.ndarray) -> np.ndarray:
    return np.array([[first, cross], [cross, last]]).transpose(2, 0, 1)


def _columns(like: np.ndarray, *diagonals: ArrayLike) -> list[np.ndarray]:
    """Diagonals as columns where the signals are rows over time."""
    shape = (-1,) + (1,) * (np.ndim(like) - 1)
    return [np.reshape(value, shape) if np.ndim(value) else np.asarray(value)
            for value in diagonals]
