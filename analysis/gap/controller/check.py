"""First question to the logs: did the stated controller run."""

import functools

from clie_blocks.analysis.gap.controller.assumed import assume_controller
from clie_blocks.analysis.gap.controller.library_law import learned_law, with_library_law
from clie_blocks.analysis.gap.controller.own_law import replay_own_law
from clie_blocks.analysis.gap.controller.replay import (
    ControllerCheck,
    assume_stated_law,
    replay_controller,
)
from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw


def check_controller(problem: Problem) -> ControllerCheck:
    """Check whether the stated controller ran, as far as the logs show it without a model."""
    return _check(problem.law, problem)


@functools.singledispatch
def _check(law: Law, problem: Problem) -> ControllerCheck:
    logs = [log for log in problem.logs if log.shows_every_tick]
    if len(logs) == len(problem.logs):
        return _replay(problem)
    if not logs:
        return assume_stated_law(problem)
    slow = ", ".join(log.name for log in problem.logs if not log.shows_every_tick)
    return _replay(problem.with_log_list(logs)).with_decisions(
        (f"the controller runs more often than {slow} has samples; there its law is not checked",))


def _replay(problem: Problem) -> ControllerCheck:
    law = problem.stated_law
    if isinstance(law, BlockLaw):
        return with_library_law(replay_own_law(problem, law), problem)
    return learned_law(problem) or with_library_law(replay_controller(problem), problem)


@_check.register(LoopLaw)
def _check_user_loop(law: LoopLaw, problem: Problem) -> ControllerCheck:
    return assume_controller(problem, law)
