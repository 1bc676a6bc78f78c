"""Did a law of the user's own run?  Its block, replayed on the logs, gives the commands or not."""

import numpy as np

from clie_blocks.analysis.gap.controller.other_laws import replay_error
from clie_blocks.analysis.gap.controller.replay import ControllerCheck, encoder_steps
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import rounding_limit


def replay_own_law(problem: Problem) -> ControllerCheck:
    """Replay the block of a law on every log, from the state in which its commands begin."""
    law = problem.stated_law
    limit = rounding_limit(np.concatenate([log.u for log in problem.logs]), law.resolution,
                           problem.resolution * law.position_gain())
    error = replay_error(problem, law)
    step, coarse = encoder_steps(problem)
    wrong = tuple(int(k) for k in np.flatnonzero(error > limit))
    decisions = tuple(f"{problem.joints[k]}: the law of your own leaves {error[k]:.3g} of the "
                      f"logged command, where rounding explains {limit[k]:.3g}" for k in wrong)
    return ControllerCheck(error, limit, (), np.full((2, problem.n), np.nan), coarse, step, law,
                           decisions, decisions, unexplained=wrong)
