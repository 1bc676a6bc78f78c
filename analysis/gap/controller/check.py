"""First question to the logs: did the stated controller run."""

import functools

from clie_blocks.analysis.gap.controller.assumed import assume_controller
from clie_blocks.analysis.gap.controller.replay import ControllerCheck, replay_controller
from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw


def check_controller(problem: Problem) -> ControllerCheck:
    """Check whether the stated controller ran, as far as the logs show it without a model."""
    return _check(problem.law, problem)


@functools.singledispatch
def _check(law: Law, problem: Problem) -> ControllerCheck:
    return replay_controller(problem)


@_check.register(LoopLaw)
def _check_user_loop(law: LoopLaw, problem: Problem) -> ControllerCheck:
    return assume_controller(problem, law)
