"""The stated control law as one difference equation per joint, and its replay on a log.

    u_k = kp (q_d - q) - kd v + pe,   v = F(z) q,   F(z) = (b0 + b1/z + b2/z^2)/(1 + a1/z + a2/z^2)

A cascade of a position loop around a velocity loop has the same form with kp kv and kv.
"""

import dataclasses

import numpy as np

from clie_blocks.errors import NotIdentifiableError


@dataclasses.dataclass(frozen=True, eq=False)
class ControlLaw:
    """Sampled PD law with its velocity estimate.

    Parameters
    ----------
    kp, kd : ndarray, shape (n,)
        Gains [command/rad, command s/rad].
    numerator, denominator : ndarray, shape (3, n)
        Velocity estimate F(z) of each joint.
    period : float
        Sample time [s].
    resolution : ndarray, shape (n,)
        Rounding step of the command, 0 for none.
    saturation : ndarray, shape (n,)
        Limit of the command.
    corners : tuple of float or None
        Corners of G1 (47) [rad/s], where the estimate is one.
    discretisation : str
        Of those corners.
    """

    kp: np.ndarray
    kd: np.ndarray
    numerator: np.ndarray
    denominator: np.ndarray
    period: float
    resolution: np.ndarray
    saturation: np.ndarray
    corners: tuple | None = None
    discretisation: str = "tustin"


def control_law(robot, sample_time):
    """Return the law that a robot file states.

    Parameters
    ----------
    robot : Robot
        What is known.
    sample_time : float
        Of the log, where the robot file states none [s].

    Raises
    ------
    NotIdentifiableError
        If the law is unknown or not of the form above.

    """
    stated = robot.controller
    if stated.law not in ("pd", "cascade"):
        raise NotIdentifiableError(
            f"the control law is {stated.law!r}; the diagnosis replays laws of the kind 'pd' and "
            "'cascade': state [controller] with its gains")
    period = stated.sample_time or sample_time
    kp, kd = ((stated.kp, stated.kd) if stated.law == "pd"
              else (stated.kp * stated.kv, stated.kv))
    corners = (stated.highpass, stated.lowpass) if stated.highpass else None
    kind = stated.velocity_filter or "exact"
    discretisation = stated.discretisation or "tustin"
    zero = np.zeros(robot.n)
    b, a = velocity_estimate(kind, period, corners, discretisation)
    return ControlLaw(
        kp=np.array(kp), kd=np.array(kd), numerator=np.outer(b, zero + 1),
        denominator=np.outer(a, zero + 1), period=period,
        resolution=zero if stated.command_resolution is None else stated.command_resolution,
        saturation=zero + np.inf if stated.saturation is None else stated.saturation,
        corners=corners, discretisation=discretisation)


def velocity_estimate(kind, period, corners=None, discretisation="tustin"):
    """Coefficients ``b, a`` of the velocity estimate F(z), each of shape (3,).

    Parameters
    ----------
    kind : str
        ``two_corner`` (G1 of (47)), ``two_tap``, ``difference`` or ``exact``.
    period : float
        Sample time [s].
    corners : tuple of float
        High-pass and low-pass corner of G1 [rad/s].
    discretisation : str
        ``tustin``, ``zoh``, ``backward`` or ``forward``.

    """
    if kind == "two_tap":
        return np.array([0.5, 0.0, -0.5]) / period, np.array([1.0, 0.0, 0.0])
    if kind in ("difference", "exact") or corners is None:
        return np.array([1.0, -1.0, 0.0]) / period, np.array([1.0, 0.0, 0.0])
    high, low = corners
    if discretisation == "zoh":
        e_1, e_2 = np.exp(-high * period), np.exp(-low * period)
        b_1, a_1 = np.array([high, -high]), np.array([1.0, -e_1])
        b_2, a_2 = np.array([0.0, 1.0 - e_2]), np.array([1.0, -e_2])
    else:
        x, y = {"tustin": (0.5, 0.5), "backward": (1.0, 0.0), "forward": (0.0, 1.0)}[
            discretisation]
        b_1, a_1 = np.array([high, -high]), np.array([1 + high * period * x,
                                                      -1 + high * period * y])
        b_2, a_2 = low * period * np.array([x, y]), np.array([1 + low * period * x,
                                                              -1 + low * period * y])
    b, a = np.convolve(b_1, b_2), np.convolve(a_1, a_2)
    return b / a[0], a / a[0]


def replay(law, log):
    """Command that the law gives on the measured positions of a log, shape (N, n).

    Parameters
    ----------
    law : ControlLaw
        The law.
    log : Log
        The log.

    """
    from scipy.signal import lfilter

    moved = log.q - log.q[0]
    rate = np.stack([lfilter(law.numerator[:, k], law.denominator[:, k], moved[:, k])
                     for k in range(len(law.kp))], axis=1)
    u = law.kp * (log.q_d - log.q) - law.kd * rate + log.pe
    return np.clip(u, -law.saturation, law.saturation)
