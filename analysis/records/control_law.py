"""The stated control law as one difference equation per joint.

    u_k = kp (q_d - q) - kd v + pe,   v = F(z) q

PD (11), a cascade of a position loop around a velocity loop, and a position servo all have this
form.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.records.robot import DISCRETISATIONS
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.linear_filters import lfilter


@dataclasses.dataclass(frozen=True, eq=False)
class ControlLaw:
    """Sampled PD law with its velocity filter.

    Parameters
    ----------
    kp, kd : ndarray, shape (n,)
        Gains [command/rad, command s/rad].
    numerator, denominator : ndarray, shape (3, n)
        Velocity filter F(z) of each joint.
    period : float
        Sample time [s].
    resolution : ndarray, shape (n,)
        Rounding step of the command, 0 for none.
    saturation : ndarray, shape (n,)
        Limit of the command, infinite for none.
    corners : tuple of float or None
        Corners of G1 (47) [rad/s], where it is the filter.
    variant : str
        How the velocity is formed, see `velocity_filter`; ``exact`` is a measured one.

    """

    kp: np.ndarray
    kd: np.ndarray
    numerator: np.ndarray
    denominator: np.ndarray
    period: float
    resolution: np.ndarray
    saturation: np.ndarray
    corners: tuple | None = None
    variant: str = "difference"

    def with_filter(self, k, variant, corners):
        """Return the law with another velocity filter at the joints k, a slice of them."""
        b, a = velocity_filter(variant, self.period, corners)
        numerator, denominator = self.numerator.copy(), self.denominator.copy()
        numerator[:, k], denominator[:, k] = b[:, None], a[:, None]
        return dataclasses.replace(self, numerator=numerator, denominator=denominator,
                                   variant=variant)

    def rate(self, q):
        """Velocity as the controller forms it, at rest at the first position, shape (N, n)."""
        moved = q - q[0]
        return np.stack([lfilter(self.numerator[:, k], self.denominator[:, k], moved[:, k])
                         for k in range(len(self.kp))], axis=1)

    def command(self, q_err, dq, pe):
        """Command for a position error, a velocity and an excitation, within its limits."""
        u = self.kp * q_err - self.kd * dq + pe
        return np.clip(u, -self.saturation, self.saturation)

    def replay(self, q, q_d, pe):
        """Command on measured positions, shape (N, n)."""
        return self.command(q_d - q, self.rate(q), pe)


def control_law(controller, period, variant=None):
    """Return the law that a robot file states.

    Parameters
    ----------
    controller : Controller
        As stated.
    period : float
        Sample time [s].
    variant : str, optional
        How the velocity is formed; by default as stated, else ``tustin`` where corners are
        stated, and the backward difference where nothing is.

    """
    kp, kd = gains(controller)
    corners = (controller.highpass, controller.lowpass) if controller.highpass else None
    variant = variant or stated_variant(controller) or ("tustin" if corners else "difference")
    corners = corners if variant in DISCRETISATIONS else None
    b, a = velocity_filter("difference" if variant == "exact" else variant, period, corners)
    zero = np.zeros(len(kp))
    return ControlLaw(
        kp=kp, kd=kd, numerator=np.outer(b, zero + 1),
        denominator=np.outer(a, zero + 1), period=period,
        resolution=zero if controller.command_resolution is None
        else controller.command_resolution,
        saturation=zero + np.inf if controller.saturation is None else controller.saturation,
        corners=corners, variant=variant)


def gains(controller):
    """Gains on position and velocity as the PD law (11) has them, zero where there is none."""
    if controller.law == "cascade":
        return controller.kp * controller.kv, controller.kv
    kd = controller.kd
    return controller.kp, np.zeros_like(controller.kp) if kd is None else kd


def stated_variant(controller):
    """Name of the way in which the controller says that it forms its velocity, or None."""
    if controller.law == "servo" and controller.kd is None:
        return "none"
    if controller.velocity_filter == "two_corner":
        return controller.discretisation
    return controller.velocity_filter
