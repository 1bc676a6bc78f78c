"""The controller of a user's loop: it is part of the loop and taken as it is."""

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw


def assume_controller(problem: Problem, law: LoopLaw) -> ControllerCheck:
    """Result for the controller of a loop, which cannot be checked."""
    decisions = ["the controller is part of the loop and is taken as it is",
                 f"a missing torque enters at the port {law.ports.torque!r}"]
    if not law.ports.has_sensor:
        decisions.append("an input 'sensor' that adds to the measured position would make "
                         "encoder_eccentricity identifiable")
    at_rest = [log.name for log in problem.logs if not np.ptp(log.q_d)]
    if at_rest:
        decisions.append(f"the reference of {', '.join(at_rest)} rests or was not logged: the "
                         "loop is assumed to hold its first position")
    zero = np.zeros(problem.n)
    return ControllerCheck(
        replay_error=zero, limit=zero + np.inf, other_filter=(),
        corners=np.full((2, problem.n), np.nan), coarse=(), step=zero, law=law,
        decisions=tuple(decisions))
