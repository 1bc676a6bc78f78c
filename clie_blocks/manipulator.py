"""The two-link arm of section 5: rigid bodies, gears and motors, with nothing left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint, vector

if TYPE_CHECKING:
    import control as ct

GRAVITY = 9.81  # m/s^2, as in the paper


def mass_matrix(q: np.ndarray, mass: np.ndarray, length: np.ndarray, com: np.ndarray,
                j_link: np.ndarray) -> np.ndarray:
    """Mass matrix M(q) of the two links [kg m^2], section 5."""
    w_1 = mass[1] * com[1] ** 2 + j_link[1]
    w_2 = mass[1] * length[0] * com[1] * np.cos(q[1])
    m_11 = mass[0] * com[0] ** 2 + mass[1] * length[0] ** 2 + j_link[0] + w_1 + 2 * w_2
    return np.array([[m_11, w_1 + w_2], [w_1 + w_2, w_1]])


def coriolis(q: np.ndarray, dq: np.ndarray, mass: np.ndarray, length: np.ndarray,
             com: np.ndarray) -> np.ndarray:
    """Matrix C(q, dq) of Coriolis and centrifugal terms [N m s/rad], section 5."""
    slope = -mass[1] * length[0] * com[1] * np.sin(q[1])
    return np.array([[slope * dq[1], slope * (dq[0] + dq[1])], [-slope * dq[0], 0 * slope]])


def gravity(q: np.ndarray, mass: np.ndarray, length: np.ndarray, com: np.ndarray,
            g: PerJoint = GRAVITY) -> np.ndarray:
    """Gravity torque G(q) of the links [N m]; q[0] = 0 is horizontal, q[1] relative to link 1."""
    w_3 = mass[1] * g * com[1] * np.cos(q[0] + q[1])
    return np.array([(mass[0] * com[0] + mass[1] * length[0]) * g * np.cos(q[0]) + w_3, w_3])


def arm_acceleration(q: np.ndarray, dq: np.ndarray, u: np.ndarray, links: Sequence[np.ndarray],
                     motors: Sequence[np.ndarray], g: PerJoint = GRAVITY) -> np.ndarray:
    """Acceleration of arm, gears and motors together, eqs. (1)-(5) [rad/s^2].

    Parameters
    ----------
    q, dq : array_like, shape (2,)
        Joint angles [rad] and velocities [rad/s].
    u : array_like, shape (2,)
        Motor torques [N m].
    links : tuple
        mass [kg], length [m], com [m], j_link [kg m^2], h [N m s/rad], each of shape (2,).
    motors : tuple
        gear_ratio, j_motor [kg m^2], b_motor [N m s/rad], each of shape (2,).
    g : float
        Acceleration of gravity [m/s^2].

    """
    mass, length, com, j_link, h = links
    gear_ratio, j_motor, b_motor = motors
    inertia = (np.diag(gear_ratio * j_motor)
               + mass_matrix(q, mass, length, com, j_link) / gear_ratio[:, None])
    link_torque = coriolis(q, dq, mass, length, com) @ dq + h * dq + gravity(
        q, mass, length, com, g)
    return np.linalg.solve(inertia, u - gear_ratio * b_motor * dq - link_torque / gear_ratio)


def two_link_arm(mass: ArrayLike, length: ArrayLike, gear_ratio: ArrayLike, j_motor: ArrayLike,
                 b_motor: ArrayLike, *, com: ArrayLike | None = None, j_link: ArrayLike = 0.0,
                 h: ArrayLike = 0.0, g: float = GRAVITY,
                 name: str = "plant") -> ct.NonlinearIOSystem:
    """Two-link arm with motors and gears, eqs. (1)-(7) and section 5, no decoupling assumed.

    Inputs: u [N m], motor side.  Outputs: q [rad], dq [rad/s].  State: q, dq.

    Parameters
    ----------
    mass, length : array_like, shape (2,)
        Link masses [kg] and lengths [m], positive.
    gear_ratio : array_like, shape (2,)
        Motor turns per joint turn, positive.
    j_motor, b_motor : array_like, shape (2,)
        Rotor inertias [kg m^2] (positive) and rotor friction [N m s/rad].
    com : array_like, shape (2,), optional
        Distance of each centre of mass from its joint [m]; by default the link's length, as in
        the paper (point masses at the tips).
    j_link : array_like, shape (2,)
        Link inertias about their centres of mass [kg m^2]; the paper does not give them.
    h : array_like, shape (2,)
        Viscous friction of the joint bearings [N m s/rad].
    g : float
        Acceleration of gravity [m/s^2].
    name : str
        Name of the block; the keys are ``'{name}.mass'`` and so on.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If a length differs from 2 or a quantity that must be positive is not.

    Notes
    -----
    Rigid links and gears in one vertical plane; the gyroscopic torque of the rotors is neglected.

    """
    from clie_blocks.joints import second_order

    link = {"mass": (mass, "kg", 0), "length": (length, "m", 0),
            "com": (length if com is None else com, "m", None),
            "j_link": (j_link, "kg m^2", None), "h": (h, "N m s/rad", None)}
    motor = {"gear_ratio": (gear_ratio, "", 0), "j_motor": (j_motor, "kg m^2", 0),
             "b_motor": (b_motor, "N m s/rad", None)}
    params = {f"{name}.{key}": vector(value, f"{name}: {key}", n=2, unit=unit, above=above)
              for key, (value, unit, above) in {**link, **motor}.items()}

    def acceleration(q: np.ndarray, dq: np.ndarray, u: np.ndarray,
                     params: dict[str, np.ndarray]) -> np.ndarray:
        links = [params[f"{name}.{key}"] for key in link]
        motors = [params[f"{name}.{key}"] for key in motor]
        return arm_acceleration(q, dq, u, links, motors, params[f"{name}.g"])

    return second_order(acceleration, {**params, f"{name}.g": float(g)}, n=2, name=name)
