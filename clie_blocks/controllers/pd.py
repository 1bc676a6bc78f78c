"""PD control with excitation, for the robot and its model alike."""

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.gains import positive_gains
from clie_blocks.labels import PerJoint
from clie_blocks.signals import signals


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
    gains = positive_gains(kp, kd, name)
    n = gains["kp"].size

    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        q_d, q, dq, pe = u.reshape(4, n)
        return pd_torque(q_d, q, dq, pe, params["kp"], params["kd"])

    return ct.nlsys(None, output, dt=None, name=name, params=gains, outputs=signals("u", n=n),
                    inputs=signals("q_d", "q", "dq", "pe", n=n))
