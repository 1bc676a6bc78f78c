"""Laws of a robot file that run as a block: PID, and PD and cascade with more than (11) has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records.control_law import stated_variant
from clie_blocks.analysis.records.robot import Controller
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.linear_filters import DISCRETISATIONS

if TYPE_CHECKING:
    from control import NonlinearIOSystem


def law_block(controller: Controller, period: float, n: int) -> NonlinearIOSystem | None:
    """Block of the law that a robot file states with gains; None for a program.

    Parameters
    ----------
    controller : Controller
        As stated.
    period : float
        Sample time [s].
    n : int
        Joints.

    """
    from clie_blocks.controllers import VelocityFilter, sampled_cascade, sampled_pid
    from clie_blocks.controllers.sampled import UNLIMITED

    if controller.is_program or controller.kp is None:
        return None
    corners, zero = controller.corners, np.zeros(n)
    variant = stated_variant(controller) or ("tustin" if corners else "difference")
    rate = VelocityFilter(period, kind=variant, corners=corners)
    if corners is None or variant not in DISCRETISATIONS:
        variant = "difference" if variant == "exact" else variant
        rate = VelocityFilter(period, velocity_filter(variant, period))
    limit = UNLIMITED + zero if controller.saturation is None else controller.saturation
    hold = controller.anti_windup or "conditional"
    ki = zero if controller.ki is None else controller.ki
    if controller.law == "cascade":
        return sampled_cascade(controller.kp, zero if controller.kv is None else controller.kv, ki,
                               period, velocity_filter=rate, anti_windup=hold, limit=limit)
    return sampled_pid(controller.kp, ki, zero if controller.kd is None else controller.kd, period,
                       velocity_filter=rate, velocity_of_error=controller.velocity_of == "error",
                       anti_windup=hold, tracking_time=controller.tracking_time or 0.1,
                       limit=limit)
