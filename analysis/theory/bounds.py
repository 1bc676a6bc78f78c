"""Conditions and ultimate bounds of the paper's theorems, as they follow and as printed.

The condition ``Kp^-1 Kd A_bar - I > 0`` decides; mu_0 (18), mu_1 (A.5) and mu_2 (A.12) bound how
far the loop may move from rest.  None of these balls is invariant; the level set of
`clie_blocks.analysis.theory.lyapunov` is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.theory.lyapunov import LevelSet, level_set_around, lyapunov_pd_matrices
from clie_blocks.labels import vector


@dataclass(frozen=True)
class ControlledJoints:
    """Decoupled joints (9) under the PD law (11).

    Parameters
    ----------
    a, b, d : array_like, shape (n,)
        Coefficients of eq. (9) [1/s, 1/(kg m^2), rad/s^2]; a not negative, b positive.
    kp, kd : array_like, shape (n,)
        PD gains [N m/rad], [N m s/rad], positive.

    """

    a: np.ndarray
    b: np.ndarray
    d: np.ndarray
    kp: np.ndarray
    kd: np.ndarray

    def __post_init__(self) -> None:
        n = np.size(self.a)
        for key, unit, rule in (("a", "1/s", {"least": 0}), ("b", "1/(kg m^2)", {"above": 0}),
                                ("d", "rad/s^2", {}), ("kp", "N m/rad", {"above": 0}),
                                ("kd", "N m s/rad", {"above": 0})):
            checked = vector(getattr(self, key), key, n=n, unit=unit, **rule)
            object.__setattr__(self, key, checked)

    @classmethod
    def from_theta(cls, theta: ArrayLike, kp: ArrayLike, kd: ArrayLike) -> Self:
        """Joints with the parameters ``theta = [a, b, d]``, shape (3n,)."""
        a, b, d = np.reshape(theta, (3, -1))
        return cls(a, b, d, np.asarray(kp), np.asarray(kd))

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.a.size

    @property
    def theta(self) -> np.ndarray:
        """Parameters ``[a, b, d]``, shape (3n,)."""
        return np.concatenate((self.a, self.b, self.d))

    @property
    def a_bar(self) -> np.ndarray:
        """``W = A_bar = A + B Kd`` [1/s], eqs. (14), (24)."""
        return self.a + self.b * self.kd

    @property
    def b_bar(self) -> np.ndarray:
        """``B_bar = B Kp`` [1/s^2], eq. (24)."""
        return self.b * self.kp

    @property
    def k_bar(self) -> np.ndarray:
        """``K_bar = Kp^-1 Kd A_bar - I``, Theorem 1."""
        return self.kd / self.kp * self.a_bar - 1


@dataclass(frozen=True)
class Condition:
    """The condition ``K_bar > 0`` of Theorems 1 to 4, joint by joint.

    Parameters
    ----------
    per_joint : ndarray, shape (n,)
        Diagonal of K_bar; the distance to instability of the proof.
    smallest_kd : ndarray, shape (n,)
        Kd [N m s/rad] above which it holds, for the given Kp.
    largest_kp : ndarray, shape (n,)
        Kp [N m/rad] below which it holds, for the given Kd.

    """

    per_joint: np.ndarray
    smallest_kd: np.ndarray
    largest_kp: np.ndarray

    @property
    def margin(self) -> float:
        """Smallest entry of K_bar."""
        return float(np.min(self.per_joint))

    @property
    def holds(self) -> bool:
        """Whether the condition holds for every joint."""
        return self.margin > 0


def condition(joints: ControlledJoints) -> Condition:
    """Condition ``Kp^-1 Kd A_bar - I > 0`` with its margin and the gains at its edge.

    At the edge ``kp = kd (a + b kd)``; it is sufficient for the identification loop, while the PD
    loop alone is stable for all positive gains.

    Parameters
    ----------
    joints : ControlledJoints
        Robot and gains.

    Returns
    -------
    Condition
        Per joint.

    """
    a, b = joints.a, joints.b
    smallest_kd = 2 * joints.kp / (a + np.sqrt(a**2 + 4 * b * joints.kp))
    return Condition(joints.k_bar, smallest_kd, joints.kd * joints.a_bar)


def disturbance_norm(joints: ControlledJoints, pe: Callable[[float], ArrayLike],
                     horizon: float = 2.0, step: float = 1e-4) -> tuple[float, float]:
    """Largest ``||eta(t)|| = ||B PE(t) - D||`` over a time, eq. (16).

    Parameters
    ----------
    joints : ControlledJoints
        Robot and gains.
    pe : callable
        Excitation [N m]: ``pe(t)`` gives a number or shape (n,).
    horizon : float
        Time over which to look [s]; a period of the excitation is enough.
    step : float
        Grid [s].

    Returns
    -------
    norm : float
        The largest value [rad/s^2].
    instant : float
        When it is reached [s].

    """
    time, torque = sampled_excitation(pe, joints.n, horizon, step)
    eta = joints.b * torque - joints.d
    norms = np.linalg.norm(eta, axis=1)
    return float(np.max(norms)), float(time[np.argmax(norms)])


def sampled_excitation(pe: Callable[[float], ArrayLike], n: int, horizon: float, step: float,
                       ) -> tuple[np.ndarray, np.ndarray]:
    """Times [s], and an excitation of n joints at them, shape (samples, n)."""
    time = np.arange(0.0, horizon, step)
    rows = np.empty((time.size, n))
    for row, t in zip(rows, time):
        row[:] = pe(t)
    return time, rows


@dataclass(frozen=True)
class UltimateBound:
    """The radius mu_0 (18), its ingredients, and the level set of V (14) that is invariant.

    Parameters
    ----------
    mu_0 : float
        Radius outside which V (14) falls.
    lambda_min_a : float
        Smallest eigenvalue of script A of (17).
    norm_b : float
        Norm of script B of (17).
    eta_norm : float
        Bound on the disturbance [rad/s^2].
    invariant : LevelSet
        The set that a trajectory enters and stays in; its outer radius is the bound that holds.

    """

    mu_0: float
    lambda_min_a: float
    norm_b: float
    eta_norm: float
    invariant: LevelSet


def ultimate_bound(joints: ControlledJoints, eta_norm: float) -> UltimateBound:
    """Radius mu_0 of the PD loop under a bounded disturbance, eq. (18).

    Parameters
    ----------
    joints : ControlledJoints
        Robot and gains.
    eta_norm : float
        Bound on ||B PE - D|| [rad/s^2], see `disturbance_norm`.

    Returns
    -------
    UltimateBound
        With ``x = (||dq||, ||q_err||)``, which mixes rad/s and rad, as the paper does.

    """
    w = joints.a_bar
    lambda_min_a = float(min(np.min(w), np.min(w * joints.b_bar)) / 2)
    norm_b = float(np.hypot(1, np.max(w) / 2))
    mu_0 = norm_b * eta_norm / lambda_min_a
    matrices = lyapunov_pd_matrices(w, joints.b, joints.kp)
    return UltimateBound(mu_0, lambda_min_a, norm_b, eta_norm, level_set_around(matrices, mu_0))


@dataclass(frozen=True)
class Theorem2:
    """Constants of Theorem 2: update law (27) with a bounded modelling error.

    Parameters
    ----------
    k_1, k_2 : float
        As defined.
    k_1_printed : float
        As the paper computes it: K_bar without its ``-I``.
    threshold : float
        ``sqrt(2) k_2 eps_bar`` of (31).
    mu_1 : float
        Radius in E outside which V (A.1) falls, (A.5).
    mu_1_printed : float
        The same with `k_1_printed`.

    """

    k_1: float
    k_2: float
    k_1_printed: float
    threshold: float
    mu_1: float
    mu_1_printed: float

    @property
    def rho(self) -> float:
        """Slack of (31); it compares unlike quantities and only says mu_1 < 1."""
        return self.k_1 - self.threshold


def theorem_2(joints: ControlledJoints, eps_bar: float) -> Theorem2:
    """Constants k_1, k_2, mu_1 and rho of Theorem 2 and (31).

    Parameters
    ----------
    joints : ControlledJoints
        Robot and gains.
    eps_bar : float
        Bound on the modelling error of (29) [rad/s^2].

    Returns
    -------
    Theorem2
        mu_1 is infinite where the condition fails: then the theorem says nothing.

    """
    k_1, k_2 = _k_1(joints, joints.k_bar), _k_2(joints)
    k_1_printed = _k_1(joints, joints.k_bar + 1)
    threshold = float(np.sqrt(2) * k_2 * eps_bar)
    return Theorem2(k_1, k_2, k_1_printed, threshold, _ratio(threshold, k_1),
                    _ratio(threshold, k_1_printed))


@dataclass(frozen=True)
class Theorem4:
    """Constants of Theorem 4: composite law (40) with bounded modelling errors.

    Parameters
    ----------
    k_3, k_4 : float
        With the minimum that the proof needs.
    k_3_printed : float
        With the printed maximum, and K_bar without its ``-I``.
    threshold : float
        ``sqrt(2 eps_bar^2 + eps_f_bar^2) k_4`` of (46).
    mu_2 : float
        Radius in ``(e, de, e_f)`` outside which V falls, (A.12).
    mu_2_printed : float
        The formula in the theorem, ``sqrt(2 eps_f_bar + eps_bar) k_4 / k_3_printed``.

    """

    k_3: float
    k_4: float
    k_3_printed: float
    threshold: float
    mu_2: float
    mu_2_printed: float

    @property
    def varrho(self) -> float:
        """Slack of (46); negative where (46) fails."""
        return self.k_3 - self.threshold

    @property
    def holds(self) -> bool:
        """Whether (46) holds with the minimum."""
        return self.varrho > 0


def theorem_4(joints: ControlledJoints, alpha: float, eps_bar: float,
              eps_f_bar: float | None = None) -> Theorem4:
    """Constants k_3, k_4, mu_2 and varrho of Theorem 4 and (46).

    Parameters
    ----------
    joints : ControlledJoints
        Robot and gains.
    alpha : float
        Gain of the gradient method, positive.
    eps_bar : float
        Bound on the modelling error of (29) [rad/s^2].
    eps_f_bar : float, optional
        Bound on the filtered error of (45) [rad/s^2]; by default equal, as in the paper.

    Returns
    -------
    Theorem4
        mu_2 is infinite where the condition fails.

    """
    eps_f_bar = eps_bar if eps_f_bar is None else eps_f_bar
    k_3 = min(_k_1(joints, joints.k_bar), float(alpha))
    k_3_printed = max(_k_1(joints, joints.k_bar + 1), float(alpha))
    k_4 = max(_k_2(joints), float(alpha))
    threshold = float(np.sqrt(2 * eps_bar**2 + eps_f_bar**2) * k_4)
    by_text = float(np.sqrt(2 * eps_f_bar + eps_bar) * k_4)
    return Theorem4(k_3, k_4, k_3_printed, threshold, _ratio(threshold, k_3),
                    _ratio(by_text, k_3_printed))


def _k_1(joints: ControlledJoints, k_bar: np.ndarray) -> float:
    return float(min(np.min(joints.kd * joints.b_bar), np.min(joints.kd * k_bar)))


def _k_2(joints: ControlledJoints) -> float:
    return float(max(np.max(joints.kd), np.max(joints.kd**2 / joints.kp)))


def _ratio(threshold: float, gain: float) -> float:
    return threshold / gain if gain > 0 else float("inf")
