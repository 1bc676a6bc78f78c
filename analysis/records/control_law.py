"""The stated control law as one difference equation per joint.

    u_k = kp (q_d - q) - kd v + pe,   v = F(z) q

PD (11), a cascade of a position loop around a velocity loop, and a position servo all have this
form.
"""

import dataclasses
from typing import Self

import numpy as np

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.velocity_filter import settling, velocity_filter
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import DISCRETISATIONS, frequency_response, lfilter

HALF_CIRCLE = 4096  # frequencies from 0 to Nyquist at which a velocity filter is integrated


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
    corners: tuple[float, float] | None = None
    variant: str = "difference"

    @property
    def settling(self) -> int:
        """Samples after which all velocity filters have forgotten how their runs began."""
        return max(map(settling, self.denominator.T))

    def with_filter(self, k: slice, variant: str,
                    corners: tuple[float, float] | None) -> Self:
        """Return the law with another velocity filter at the joints k, a slice of them."""
        b, a = velocity_filter(variant, self.period, corners)
        numerator, denominator = self.numerator.copy(), self.denominator.copy()
        numerator[:, k], denominator[:, k] = b[:, None], a[:, None]
        return dataclasses.replace(self, numerator=numerator, denominator=denominator,
                                   variant=variant)

    def rate(self, q: np.ndarray) -> np.ndarray:
        """Velocity as the controller forms it, at rest at the first position, shape (N, n)."""
        moved = q - q[0]
        return np.stack([lfilter(self.numerator[:, k], self.denominator[:, k], moved[:, k])
                         for k in range(len(self.kp))], axis=1)

    def position_gain(self) -> np.ndarray:
        """RMS of the command over that of white noise in the position, shape (n,)."""
        if self.variant == "exact":
            return np.abs(self.kp)
        frequency = np.pi * (np.arange(HALF_CIRCLE) + 0.5) / HALF_CIRCLE
        rates = np.stack([frequency_response(self.numerator[:, k], self.denominator[:, k],
                                             frequency) for k in range(len(self.kp))], axis=1)
        return np.sqrt(np.mean(np.abs(self.kp + self.kd * rates) ** 2, axis=0))

    def command(self, q_err: np.ndarray, dq: np.ndarray, pe: np.ndarray | float) -> np.ndarray:
        """Command for a position error, a velocity and an excitation, within its limits."""
        u = self.kp * q_err - self.kd * dq + pe
        return np.clip(u, -self.saturation, self.saturation)

    def replay(self, q: np.ndarray, q_d: np.ndarray, pe: np.ndarray | float) -> np.ndarray:
        """Command on measured positions, shape (N, n)."""
        return self.command(q_d - q, self.rate(q), pe)


def control_law(controller: Controller, period: float, variant: str | None = None) -> ControlLaw:
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
    corners = controller.corners
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


def gains(controller: Controller) -> tuple[np.ndarray, np.ndarray]:
    """Gains on position and velocity as the PD law (11) has them, zero where there is none."""
    if controller.kp is None:
        raise NotIdentifiableError("the control law has no gains; state [controller] Kp in "
                                   "robot.toml")
    if controller.law == "cascade" and controller.kv is not None:
        return controller.kp * controller.kv, controller.kv
    kd = controller.kd
    return controller.kp, np.zeros_like(controller.kp) if kd is None else kd


def stated_variant(controller: Controller) -> str | None:
    """Name of the way in which the controller says that it forms its velocity, or None."""
    if controller.law == "servo" and controller.kd is None:
        return "none"
    if controller.velocity_filter == "two_corner":
        return controller.discretisation
    return controller.velocity_filter
