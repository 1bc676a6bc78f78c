"""Did a law of the user's own run?  Its block, replayed on the logs, gives the commands or not.

Where it does not, its parameters may be others than stated: those that give the commands are found
from all logs together, and of them as few are changed as the commands need.
"""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.block_refit import (
    error_of,
    name_of,
    with_parameters_that_ran,
    with_rounded_reference,
)
from clie_blocks.analysis.gap.controller.other_laws import describe_filter, replay_error
from clie_blocks.analysis.gap.controller.replay import (
    ControllerCheck,
    LawParameter,
    describe_parameters,
    encoder_steps,
)
from clie_blocks.analysis.gap.controller.terms import find_weights
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.checks.law import shared_ratio
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.linear_filters import CORNERS

GAINS = ("kp", "ki", "kd", "kv")  # parameters that all are in one unit


def replay_own_law(problem: Problem, law: BlockLaw) -> ControllerCheck:
    """Replay the block of a law on every log, from the state in which its commands begin."""
    limit = rounding_limit(np.concatenate([log.u for log in problem.logs]), law.resolution,
                           problem.resolution * law.position_gain())
    error, changed = replay_error(problem, law), tuple[LawParameter, ...]()
    if np.any(error > limit):  # what the stated law leaves may be the digits of the reference
        rounded = with_rounded_reference(problem, law, limit)
        limit = np.where(error <= rounded, rounded, limit)
    wrong = error > limit
    if wrong.any() and len(law.parameters):
        ran, named = with_parameters_that_ran(problem, law, limit)
        left = error_of(problem, ran)
        if (wrong & (left <= limit)).any():
            law, error, changed = _without_vain_changes(problem, law, ran, left > limit, named)
    step, coarse = encoder_steps(problem)
    corners = _corners(problem, law)
    filtered = tuple(sorted({one.joint for one in changed
                             if one.name in CORNERS and one.joint is not None}))
    changed = tuple(one for one in changed if one.joint not in filtered
                    or one.name not in CORNERS)
    unexplained = tuple(int(k) for k in np.flatnonzero(error > limit))
    carries = problem.robot is not None and problem.robot.controller.compensation == "gravity"
    terms = find_weights(problem, law, limit, unexplained, float(carries))
    known = {one.joint for one in terms}
    said = (*(describe_filter(problem.joints[k], *corners[:, k]) for k in filtered),
            *describe_parameters(changed, problem.joints), *_shared_factors(changed, problem))
    return ControllerCheck(
        error, limit, filtered, corners, coarse, step, law,
        (*said, *(one.describe(problem.joints[one.joint]) for one in terms)), said, terms=terms,
        unexplained=tuple(k for k in unexplained if k not in known), recorded=bool(terms),
        parameters=changed)


def _without_vain_changes(problem: Problem, stated: BlockLaw, ran: BlockLaw, vain: np.ndarray,
                          named: tuple[LawParameter, ...],
                          ) -> tuple[BlockLaw, np.ndarray, tuple[LawParameter, ...]]:
    """Law with the parameters that ran, but those of joints that they leave unexplained.

    Such a joint lacks something else, which its own parameters have followed as far as they can.
    """
    parameters = ran.parameters.copy()
    for k in range(len(parameters)):
        joint = name_of(problem, stated, k)[1]
        if joint is not None and vain[joint]:
            parameters[k] = stated.parameters[k]
    law = stated.with_parameters(parameters)
    kept = tuple(one for one in named if one.joint is None or not vain[one.joint])
    return law, error_of(problem, law), kept


def _shared_factors(changed: Sequence[LawParameter], problem: Problem) -> tuple[str, ...]:
    """What a factor that all gains of a joint share says of their unit, side or sign."""
    sentences = []
    for k in range(problem.n):
        ratios = [one.value / one.stated for one in changed
                  if one.joint == k and one.name in GAINS and one.stated]
        if len(ratios) > 1 and problem.robot is not None:
            hint = shared_ratio(problem.robot, k, ratios)[1]
            sentences += [f"{problem.joints[k]}: {hint[0].lower()}{hint[1:-1]}"] if hint else []
    return tuple(sentences)


def _corners(problem: Problem, law: BlockLaw) -> np.ndarray:
    """Corners of each joint's velocity filter, shape (2, n) [rad/s]; NaN where it has none."""
    corners = np.full((2, problem.n), np.nan)
    for (key, joint), value in zip(law.block.parameters, law.parameters):
        if key in CORNERS and joint < problem.n:
            corners[CORNERS.index(key), joint] = value
    return corners


