"""Laws of a robot file that run as a block: PID, and PD and cascade with more than (11) has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records.control_law import stated_variant
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.linear_filters import DISCRETISATIONS

if TYPE_CHECKING:
    from control import NonlinearIOSystem

    from clie_blocks.controllers import VelocityFilter


def law_block(controller: Controller, period: float, n: int) -> NonlinearIOSystem | None:
    """Block of the law that a robot file states with gains; None for a program.

    What it adds of the robot's own model, its `compensation`, is not in it.

    Parameters
    ----------
    controller : Controller
        As stated.
    period : float
        Sample time [s].
    n : int
        Joints.

    """
    if controller.is_program or controller.kp is None:
        return None
    rate = velocity_of(controller, period)
    return _extended(_base(controller, period, n, rate), controller, rate)


def velocity_of(controller: Controller, period: float) -> VelocityFilter:
    """Filter by which a controller forms its velocity."""
    from clie_blocks.controllers import VelocityFilter

    corners = controller.corners
    variant = stated_variant(controller) or ("tustin" if corners else "difference")
    if corners is not None and variant in DISCRETISATIONS:
        return VelocityFilter(period, kind=variant, corners=corners)
    variant = "difference" if variant == "exact" else variant
    return VelocityFilter(period, velocity_filter(variant, period))


def _base(controller: Controller, period: float, n: int,
          rate: VelocityFilter) -> NonlinearIOSystem:
    from clie_blocks.controllers import sampled_cascade, sampled_pid
    from clie_blocks.controllers.sampled import UNLIMITED

    zero = np.zeros(n)
    limit = UNLIMITED + zero if controller.saturation is None else controller.saturation
    if controller.compensation == "computed_torque":
        limit = UNLIMITED + zero  # this law computes an acceleration
    hold = controller.anti_windup or "conditional"
    ki = zero if controller.ki is None else controller.ki
    kp = zero if controller.kp is None else controller.kp
    if controller.law == "cascade":
        return sampled_cascade(kp, zero if controller.kv is None else controller.kv, ki,
                               period, velocity_filter=rate, anti_windup=hold, limit=limit,
                               every=int(controller.position_every or 1))
    return sampled_pid(kp, ki, zero if controller.kd is None else controller.kd, period,
                       velocity_filter=rate, velocity_of_error=controller.velocity_of == "error",
                       anti_windup=hold, tracking_time=controller.tracking_time or 0.1,
                       limit=limit)


def _extended(law: NonlinearIOSystem, controller: Controller,
              rate: VelocityFilter) -> NonlinearIOSystem:
    """Law with what else a robot file states by numbers, the innermost part first."""
    from clie_blocks.controllers import (
        with_dead_band,
        with_feedforward,
        with_filter,
        with_rate_limit,
    )

    if controller.dead_band is not None or controller.punch is not None:
        law = with_dead_band(law, 0.0 if controller.dead_band is None else controller.dead_band,
                             0.0 if controller.punch is None else controller.punch)
    if controller.error_filter is not None:
        law = with_filter(law, "error", **_of_filter(controller.error_filter))
    if controller.feedforward is not None:
        law = with_feedforward(
            law, rate=controller.reference_rate or "difference", velocity_filter=rate,
            **{key.removesuffix("_rad_s"): value for key, value in controller.feedforward.items()})
    if controller.command_filter is not None:
        law = with_filter(law, "command", **_of_filter(controller.command_filter))
    if controller.command_rate is not None:
        law = with_rate_limit(law, controller.command_rate)
    return law


def _of_filter(table: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {key.removesuffix("_rad_s"): value for key, value in table.items()}
