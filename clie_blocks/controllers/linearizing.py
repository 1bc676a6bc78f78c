"""Feedback linearisation with estimated parameters."""

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.gains import positive_gains
from clie_blocks.labels import PerJoint
from clie_blocks.signals import signals, vector


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
    gains = positive_gains(kp, kd, name)
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
