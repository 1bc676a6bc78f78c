"""PD control with excitation, for the robot and its model alike; feedback linearisation."""

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint
from clie_blocks.signals import DiagramError, signals, vector


def pd_torque(q_d: np.ndarray, q: np.ndarray, dq: np.ndarray, pe: np.ndarray, kp: PerJoint,
              kd: PerJoint) -> np.ndarray:
    """PD torque with excitation, eq. (11): ``u = Kp (q_d - q) - Kd dq + PE``."""
    return kp * (q_d - q) - kd * dq + pe


def pd_controller(kp: ArrayLike, kd: ArrayLike, *, name: str = "pd") -> ct.NonlinearIOSystem:
    """PD controller with persistent excitation, eqs. (11) and (20).

    Inputs: q_d, q [rad], dq [rad/s], pe [N m].  Outputs: u [N m], motor side.  No state.

    Parameters
    ----------
    kp, kd : array_like, shape (n,)
        Diagonals of Kp [N m/rad] and Kd [N m s/rad], all positive.  The keys ``'kp'`` and
        ``'kd'`` are shared on purpose: the method needs the same gains in both loops.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If a gain is not positive or the lengths differ.

    Notes
    -----
    The reference is taken as constant: there is no term ``Kd dq_d``.  With a moving reference the
    law stays (11), and damping opposes the commanded motion.

    """
    gains = _gains(kp, kd, name)
    n = gains["kp"].size

    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        q_d, q, dq, pe = u.reshape(4, n)
        return pd_torque(q_d, q, dq, pe, params["kp"], params["kd"])

    return ct.nlsys(None, output, dt=None, name=name, params=gains, outputs=signals("u", n=n),
                    inputs=signals("q_d", "q", "dq", "pe", n=n))


def linearizing_torque(q_d: np.ndarray, dq_d: np.ndarray, ddq_d: np.ndarray, q: np.ndarray,
                       dq: np.ndarray, a: PerJoint, b: PerJoint, d: PerJoint, kp: PerJoint,
                       kd: PerJoint) -> np.ndarray:
    """Feedback linearisation, eq. (50) with ``+d``: makes the joint follow a PD error law."""
    return (a * dq + d + kp * (q_d - q) + kd * (dq_d - dq) + ddq_d) / b


def linearizing_controller(a: ArrayLike, b: ArrayLike, d: ArrayLike, kp: ArrayLike, kd: ArrayLike,
                           *, printed_sign: bool = False,
                           name: str = "controller") -> ct.NonlinearIOSystem:
    """Feedback linearisation with estimated parameters, eq. (50), Fig. 5.

    Inputs: q_d, dq_d, ddq_d, q, dq [rad, rad/s, rad/s^2].  Outputs: u [N m].  No state.

    Parameters
    ----------
    a, b, d : array_like, shape (n,)
        Estimates of A [1/s], B [1/(kg m^2)] (positive) and D [rad/s^2] of eq. (9).
    kp, kd : array_like, shape (n,)
        Gains of the error dynamics [1/s^2] and [1/s], all positive.
    printed_sign : bool
        Use ``-d`` as (50) is printed.  That does not cancel D but doubles it; ``+d`` follows
        from (9) and is the default.
    name : str
        Name of the block; the keys of a, b and d are ``'{name}.a'`` and so on.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If b or a gain is not positive or the lengths differ.

    """
    gains = _gains(kp, kd, name)
    n = gains["kp"].size
    sign = -1.0 if printed_sign else 1.0
    estimates = {f"{name}.a": vector(a, f"{name}: a", n=n, unit="1/s"),
                 f"{name}.b": vector(b, f"{name}: b", n=n, unit="1/(kg m^2)", above=0),
                 f"{name}.d": vector(d, f"{name}: d", n=n, unit="rad/s^2")}

    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        q_d, dq_d, ddq_d, q, dq = u.reshape(5, n)
        a, b, d = (params[f"{name}.{key}"] for key in "abd")
        return linearizing_torque(q_d, dq_d, ddq_d, q, dq, a, b, sign * d, params["kp"],
                                  params["kd"])

    return ct.nlsys(None, output, dt=None, name=name, params={**gains, **estimates},
                    inputs=signals("q_d", "dq_d", "ddq_d", "q", "dq", n=n),
                    outputs=signals("u", n=n))


def _gains(kp: ArrayLike, kd: ArrayLike, name: str) -> dict[str, np.ndarray]:
    gains = {"kp": vector(kp, f"{name}: kp", unit="N m/rad", above=0),
             "kd": vector(kd, f"{name}: kd", unit="N m s/rad", above=0)}
    if gains["kp"].size != gains["kd"].size:
        raise DiagramError(f"{name}: kp has {gains['kp'].size} gains but kd has "
                           f"{gains['kd'].size}; give one of each per joint")
    return gains
