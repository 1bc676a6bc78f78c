"""Decoupled joints, eqs. (4)-(10), and the estimated model that runs in parallel, eq. (19)."""

from collections.abc import Callable, Mapping

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint
from clie_blocks.signals import signals, vector


def joint_acceleration(dq: np.ndarray, u: np.ndarray, a: PerJoint, b: PerJoint,
                       d: PerJoint) -> np.ndarray:
    """Joint acceleration, eq. (9): ``ddq = -A dq + B u - D``."""
    return -a * dq + b * u - d


def decoupled_joints(a: ArrayLike, b: ArrayLike, d: ArrayLike, *,
                     name: str = "plant") -> ct.NonlinearIOSystem:
    """Decoupled joints in normalised form, eq. (9).

    Inputs: u [N m], motor side.  Outputs: q [rad], dq [rad/s].  State: q, dq.

    Parameters
    ----------
    a : array_like, shape (n,)
        Damping over inertia [1/s], positive.
    b : array_like, shape (n,)
        One over inertia [1/(kg m^2)], positive.
    d : array_like, shape (n,)
        Constant disturbance over inertia [rad/s^2].
    name : str
        Name of the block; the keys are ``'{name}.a'``, ``'{name}.b'``, ``'{name}.d'``.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If a or b is not positive or the lengths differ.

    Notes
    -----
    Right for high gear ratios only: inertia, load and coupling of the links are taken as
    constant.  `clie_blocks.manipulator.two_link_arm` has them all.

    """
    a = vector(a, f"{name}: a", unit="1/s", above=0)
    b = vector(b, f"{name}: b", n=a.size, unit="1/(kg m^2)", above=0)
    d = vector(d, f"{name}: d", n=a.size, unit="rad/s^2")

    def acceleration(q: np.ndarray, dq: np.ndarray, u: np.ndarray,
                     params: dict[str, np.ndarray]) -> np.ndarray:
        return joint_acceleration(dq, u, *(params[f"{name}.{key}"] for key in "abd"))

    return second_order(acceleration, {f"{name}.a": a, f"{name}.b": b, f"{name}.d": d},
                        n=a.size, name=name)


def inertial_joints(inertia: ArrayLike, damping: ArrayLike, load: ArrayLike, *,
                    name: str = "plant") -> ct.NonlinearIOSystem:
    """Decoupled joints in physical form, eq. (8): ``inertia ddq + damping dq + load = u``.

    Inputs: u [N m], motor side.  Outputs: q [rad], dq [rad/s].  State: q, dq.

    Parameters
    ----------
    inertia : array_like, shape (n,)
        Inertia seen by the motor torque [kg m^2], positive.
    damping : array_like, shape (n,)
        Viscous damping [N m s/rad], positive.
    load : array_like, shape (n,)
        Constant load torque [N m].
    name : str
        Name of the block; the keys are ``'{name}.inertia'`` and so on.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If inertia or damping is not positive or the lengths differ.

    """
    inertia = vector(inertia, f"{name}: inertia", unit="kg m^2", above=0)
    n = inertia.size
    damping = vector(damping, f"{name}: damping", n=n, unit="N m s/rad", above=0)
    load = vector(load, f"{name}: load", n=n, unit="N m")

    def acceleration(q: np.ndarray, dq: np.ndarray, u: np.ndarray,
                     params: dict[str, np.ndarray]) -> np.ndarray:
        inertia, damping, load = (params[f"{name}.{key}"]
                                  for key in ("inertia", "damping", "load"))
        return (u - damping * dq - load) / inertia

    return second_order(acceleration, {f"{name}.inertia": inertia, f"{name}.damping": damping,
                                       f"{name}.load": load}, n=n, name=name)


def held_joint_step(q: np.ndarray, dq: np.ndarray, u: np.ndarray, a: PerJoint, b: PerJoint,
                    d: PerJoint, period: float) -> tuple[np.ndarray, np.ndarray]:
    """State of eq. (9) one period later, with u held: exact, and finite for ``a = 0``.

    Parameters
    ----------
    q, dq, u : array_like, shape (n,)
        Position [rad], velocity [rad/s] and held input [N m].
    a, b, d : array_like, shape (n,)
        Coefficients of eq. (9).
    period : float
        Sample time [s].

    Returns
    -------
    q, dq : ndarray, shape (n,)
        Position [rad] and velocity [rad/s] after `period` [s].

    """
    x = a * period
    small = np.abs(x) < 0.03  # below it the closed form of `push` cancels
    safe = np.where(small, 1.0, x)
    travel = period * np.where(x == 0, 1.0, -np.expm1(-x) / np.where(x == 0, 1.0, x))
    series = 1 / 2 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (
        1 / 720 - x * (1 / 5040 - x / 40320)))))
    push = period**2 * np.where(small, series, (safe + np.expm1(-safe)) / safe**2)
    force = b * u - d
    return q + travel * dq + push * force, np.exp(-x) * dq + travel * force


def estimated_model(n: int, *, period: float | None = None,
                    name: str = "model") -> ct.NonlinearIOSystem:
    """Estimated model, eq. (19), whose parameters arrive as a signal.

    Inputs: u [N m], theta_hat (3n,) = [a_hat, b_hat, d_hat] [1/s, 1/(kg m^2), rad/s^2].
    Outputs: q [rad], dq [rad/s].  State: q, dq.

    Parameters
    ----------
    n : int
        Number of joints.
    period : float, optional
        Sample time [s] of a discrete-time model, whose input is held over each sample, as a
        digital controller holds it.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    """
    def update(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        q, dq, torque = x[:n], x[n:], u[:n]
        a_hat, b_hat, d_hat = u[n:].reshape(3, n)
        if period is not None:
            return np.concatenate(held_joint_step(q, dq, torque, a_hat, b_hat, d_hat, period))
        return np.concatenate((dq, joint_acceleration(dq, torque, a_hat, b_hat, d_hat)))

    return ct.nlsys(update, _state, dt=period or 0, name=name, states=signals("q", "dq", n=n),
                    inputs=signals("u", n=n) + signals("theta_hat", n=3 * n),
                    outputs=signals("q", "dq", n=n))


def motor_side(mass_diagonal: ArrayLike, h: ArrayLike, gear_ratio: ArrayLike, j_motor: ArrayLike,
               b_motor: ArrayLike, *, eta: ArrayLike = 0.0, delta_r: ArrayLike = 0.0,
               delta_m: ArrayLike = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reduce links, gears and motors to eq. (6): inertia, damping and load at the motor torque.

    Parameters
    ----------
    mass_diagonal : array_like, shape (n,)
        Diagonal entries m_kk of the link mass matrix [kg m^2].
    h : array_like, shape (n,)
        Viscous friction of the joint bearings [N m s/rad].
    gear_ratio : array_like, shape (n,)
        Motor turns per joint turn, positive.
    j_motor, b_motor : array_like, shape (n,)
        Rotor inertia [kg m^2] (positive) and rotor friction [N m s/rad].
    eta, delta_r, delta_m : array_like, shape (n,)
        Coupling torque of eq. (3), link-side and motor-side disturbances [N m].

    Returns
    -------
    inertia, damping, load : ndarray, shape (n,)
        Coefficients of eq. (8) [kg m^2, N m s/rad, N m]; see `normalised`.

    Notes
    -----
    Eq. (10) as printed has lost a fraction bar; this is eq. (7), which is right.

    """
    gear_ratio = vector(gear_ratio, "gear_ratio", above=0)
    n = gear_ratio.size
    j_motor = vector(j_motor, "j_motor", n=n, unit="kg m^2", above=0)
    inertia = gear_ratio * j_motor + vector(mass_diagonal, "mass_diagonal", n=n) / gear_ratio
    damping = gear_ratio * vector(b_motor, "b_motor", n=n) + vector(h, "h", n=n) / gear_ratio
    load = (vector(eta, "eta", n=n) - vector(delta_r, "delta_r", n=n)) / gear_ratio
    return inertia, damping, load - vector(delta_m, "delta_m", n=n)


def normalised(inertia: ArrayLike, damping: ArrayLike,
               load: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients of eq. (9) from those of eq. (8): ``a, b, d``.

    Parameters
    ----------
    inertia, damping, load : array_like, shape (n,)
        Inertia [kg m^2], viscous damping [N m s/rad] and load [N m].

    Returns
    -------
    a, b, d : ndarray, shape (n,)
        Damping over inertia [1/s], one over inertia [1/(kg m^2)], load over inertia [rad/s^2].

    """
    inertia, damping, load = (np.asarray(value, float) for value in (inertia, damping, load))
    return damping / inertia, 1.0 / inertia, load / inertia


def second_order(acceleration: Callable[..., np.ndarray], params: Mapping[str, PerJoint], *,
                 n: int, name: str) -> ct.NonlinearIOSystem:
    """Build a plant with ports ``u -> q, dq`` from its acceleration.

    Parameters
    ----------
    acceleration : callable
        ``acceleration(q, dq, u, params) -> (n,)`` [rad/s^2].
    params : dict
        Parameters of the block.
    n : int
        Number of joints.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        Inputs: u.  Outputs and state: q, dq.

    """
    def update(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        q, dq = x[:n], x[n:]
        return np.concatenate((dq, acceleration(q, dq, u, params)))

    return ct.nlsys(update, _state, name=name, params=params, states=signals("q", "dq", n=n),
                    inputs=signals("u", n=n), outputs=signals("q", "dq", n=n))


def _state(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, np.ndarray]) -> np.ndarray:
    return x
