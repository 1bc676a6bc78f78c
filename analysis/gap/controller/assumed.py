"""The controller of a user's loop: it is part of the loop and taken as it is."""

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw


def assume_controller(problem: Problem, law: LoopLaw) -> ControllerCheck:
    """Check of a loop's controller: there is none."""
    decisions = ["the controller is part of the loop and is taken as it is",
                 f"a missing torque enters at the port {law.ports.torque!r}"]
    if not law.ports.has_sensor:
        decisions.append("an input 'sensor' that adds to the measured position would bring "
                         "encoder_eccentricity into reach")
    still = [log.name for log in problem.logs if not np.ptp(log.q_d)]
    if still:
        decisions.append(f"the reference of {', '.join(still)} rests or was not logged: the loop "
                         "is asked to stay where it begins")
    zero = np.zeros(problem.n)
    return ControllerCheck(zero, zero + np.inf, (), np.full((2, problem.n), np.nan), (), zero,
                           law, tuple(decisions))
