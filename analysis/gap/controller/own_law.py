"""Did a law of the user's own run?  Its block, replayed on the logs, gives the commands or not.

Where it does not, its parameters may be others than stated: those that give the commands are found
from all logs together, and of them as few are changed as the commands need.
"""

import functools

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples
from clie_blocks.analysis.gap.controller.other_laws import describe_filter, replay_error
from clie_blocks.analysis.gap.controller.refit import with_law_states
from clie_blocks.analysis.gap.controller.replay import (
    ControllerCheck,
    LawParameter,
    describe_parameters,
    encoder_steps,
)
from clie_blocks.analysis.gap.controller.terms import find_weights
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import STATE_STEP, BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import (
    MOST_OF_POSITION,
    ROUNDED_STEPS,
    rounding_limit,
)
from clie_blocks.linear_filters import CORNERS

DECIMALS, WHOLE, FIRST_ROWS = range(2, 11), 1e-4, 5000  # of references that are rounded
ROWS = 4000  # of each log, evenly apart, by which parameters are found
EVALUATIONS = 30  # in which they are found; a law that is linear in them takes two
STEP = 1e-5  # of a parameter, in the differences by which it is found
LEAST_SIZE = 1e-3  # of a parameter that is stated as zero
RANK = 1e-10  # of the largest singular value: below it, states do not show in the commands
STATE_ROUNDS = 2  # steps in which the first state is found; a linear law takes one
DIVERGED = 1e6  # limits that a law counts to leave under parameters with which it diverges
CERTAIN = 5.0  # half widths by which a parameter that ran differs from the stated one


def replay_own_law(problem: Problem, law: BlockLaw) -> ControllerCheck:
    """Replay the block of a law on every log, from the state in which its commands begin."""
    limit = rounding_limit(np.concatenate([log.u for log in problem.logs]), law.resolution,
                           problem.resolution * law.position_gain())
    error, changed = replay_error(problem, law), tuple[LawParameter, ...]()
    if np.any(error > limit):
        limit = with_rounded_reference(problem, law, limit)
    wrong = error > limit
    if wrong.any() and len(law.parameters):
        ran, named = _with_parameters_that_ran(problem, law, limit)
        left = _error_of(problem, ran)
        if (wrong & (left <= limit)).any():
            law, error, changed = _without_vain_changes(problem, law, ran, left > limit, named)
    step, coarse = encoder_steps(problem)
    corners = _corners(problem, law)
    filtered = tuple(sorted({one.joint for one in changed
                             if one.name in CORNERS and one.joint is not None}))
    changed = tuple(one for one in changed if one.joint not in filtered
                    or one.name not in CORNERS)
    unexplained = tuple(int(k) for k in np.flatnonzero(error > limit))
    carries = problem.robot is not None and problem.robot.controller.compensation is not None
    terms = find_weights(problem, law, limit, unexplained, float(carries))
    known = {one.joint for one in terms}
    said = (*(describe_filter(problem.joints[k], *corners[:, k]) for k in filtered),
            *describe_parameters(changed, problem.joints))
    return ControllerCheck(
        error, limit, filtered, corners, coarse, step, law,
        (*said, *(one.describe(problem.joints[one.joint]) for one in terms)), said, terms=terms,
        unexplained=tuple(k for k in unexplained if k not in known), recorded=bool(terms),
        parameters=changed)


def with_rounded_reference(problem: Problem, law: BlockLaw, limit: np.ndarray) -> np.ndarray:
    """Largest RMS that rounding explains, with that of the logged references, shape (n,) [N m].

    A law with the acceleration of its reference makes much of the last digit.
    """
    step = max(decimal_step(log.q_d) for log in problem.logs)
    if not step:
        return limit
    size = np.sqrt(np.mean(np.concatenate([log.u for log in problem.logs]) ** 2, axis=0))
    of_reference = ROUNDED_STEPS * step * law.reference_gain(problem.logs[0].q_d)
    return np.hypot(limit, np.minimum(of_reference, MOST_OF_POSITION * size))


def decimal_step(x: np.ndarray) -> float:
    """Decimal place to which all values are rounded; 0 where there is none that is coarse."""
    for places in DECIMALS:
        scaled = x[:FIRST_ROWS] * 10.0**places
        if np.abs(scaled - np.rint(scaled)).max() < WHOLE:
            return 10.0**-places
    return 0.0


def _without_vain_changes(problem: Problem, stated: BlockLaw, ran: BlockLaw, vain: np.ndarray,
                          named: tuple[LawParameter, ...],
                          ) -> tuple[BlockLaw, np.ndarray, tuple[LawParameter, ...]]:
    """Law with the parameters that ran, but those of joints that they leave unexplained.

    Such a joint lacks something else, which its own parameters have followed as far as they can.
    """
    parameters = ran.parameters.copy()
    for k in range(len(parameters)):
        joint = _name(problem, stated, k)[1]
        if joint is not None and vain[joint]:
            parameters[k] = stated.parameters[k]
    law = stated.with_parameters(parameters)
    kept = tuple(one for one in named if one.joint is None or not vain[one.joint])
    return law, _error_of(problem, law), kept


def _corners(problem: Problem, law: BlockLaw) -> np.ndarray:
    """Corners of each joint's velocity filter, shape (2, n) [rad/s]; NaN where it has none."""
    corners = np.full((2, problem.n), np.nan)
    for (key, joint), value in zip(law.block.parameters, law.parameters):
        if key in CORNERS and joint < problem.n:
            corners[CORNERS.index(key), joint] = value
    return corners


def _error_of(problem: Problem, law: BlockLaw) -> np.ndarray:
    """Replay error of a law that begins in the states that its own commands show, shape (n,)."""
    return replay_error(with_law_states(problem, law), law)


def _with_parameters_that_ran(problem: Problem, stated: BlockLaw, limit: np.ndarray,
                              ) -> tuple[BlockLaw, tuple[LawParameter, ...]]:
    """Law with the parameters that leave least, and those of them that had to change."""
    every = np.arange(len(stated.parameters))
    law, half = _fitted(problem, stated, every, limit)
    beyond = np.abs(law.parameters - stated.parameters) > CERTAIN * half
    fewer, half_of_fewer = _fitted(problem, stated, every[beyond], limit)
    if np.all((_error_of(problem, fewer) <= limit) | (_error_of(problem, law) > limit)):
        law, half = fewer, half_of_fewer
    return law, tuple(
        LawParameter(*_name(problem, stated, k), float(law.parameters[k]), float(half[k]),
                     float(stated.parameters[k]))
        for k in np.flatnonzero(law.parameters != stated.parameters).tolist())


def _fitted(problem: Problem, stated: BlockLaw, free: np.ndarray, limit: np.ndarray,
            ) -> tuple[BlockLaw, np.ndarray]:
    """Law whose free parameters leave least of the commands, and half the width of each."""
    from scipy.optimize import least_squares

    half = np.zeros(len(stated.parameters))
    if not len(free):
        return stated, half
    size = np.maximum(np.abs(stated.parameters[free]), LEAST_SIZE)

    def parameters(change: np.ndarray) -> np.ndarray:
        changed = stated.parameters.copy()
        changed[free] += size * change
        return changed

    @functools.lru_cache(maxsize=2)
    def regression(change: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        parts = [_regression(log, stated, parameters(np.array(change)), free, size, limit)
                 for log in problem.logs]
        columns, left = zip(*parts)
        return np.concatenate(columns), np.concatenate(left)

    fit = least_squares(lambda change: regression(tuple(change))[1], np.zeros(len(free)),
                        jac=lambda change: -regression(tuple(change))[0], xtol=1e-12,
                        max_nfev=EVALUATIONS)
    variance = np.diag(np.linalg.pinv(fit.jac.T @ fit.jac))
    half[free] = size * np.sqrt(np.maximum(variance, 0.0))
    return stated.with_parameters(parameters(fit.x)), half


def _regression(log: Log, law: BlockLaw, parameters: np.ndarray, free: np.ndarray,
                size: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the commands in a log by parameters, and what the law leaves, per limit.

    Both are those of the first state that leaves least under these parameters: a filter that
    began with the memory of another one has a transient, which would hide their slopes.
    """
    every = max(1, len(log) // ROWS)
    usable = (np.abs(log.u) < law.saturation) & known_samples(log, law)[:, None]
    weight = np.where(usable, 1.0 / limit, 0.0)[::every]

    def changes(states: list[np.ndarray], of: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """What the first run leaves, and by how much the others differ from it."""
        runs = law.run(log.law_q, log.q_d, log.pe, states, of, every)
        if not np.isfinite(runs).all():
            return np.full(runs[0].size, DIVERGED), np.zeros((runs[0].size, len(runs) - 1))
        left = ((log.u[::every] - runs[0]) * weight).ravel()
        return left, ((runs[1:] - runs[0]) * weight).reshape(len(runs) - 1, -1).T

    state = law.rest if log.law_state is None else log.law_state
    basis = np.zeros((weight.size, 0))
    for _ in range(STATE_ROUNDS if len(state) else 0):
        left, columns = changes([state, *(state + STATE_STEP * np.eye(len(state)))],
                                [parameters] * (1 + len(state)))
        basis, sizes, turn = np.linalg.svd(columns, full_matrices=False)
        shown = sizes > RANK * sizes.max(initial=0.0)
        basis = basis[:, shown]
        state = state + STATE_STEP * turn[shown].T @ ((basis.T @ left) / sizes[shown])
    changed = parameters + STEP * size[:, None] * np.eye(len(parameters))[free]
    left, columns = changes([state] * (1 + len(free)), [parameters, *changed])
    return (columns - basis @ (basis.T @ columns)) / STEP, left - basis @ (basis.T @ left)


def _name(problem: Problem, law: BlockLaw, k: int) -> tuple[str, int | None]:
    """Name of a parameter, and its joint where it has one value per joint."""
    key, place = law.block.parameters[k]
    count = sum(one == key for one, _ in law.block.parameters)
    if count == problem.n:
        return key, place
    return (key if count == 1 else f"{key}[{place}]"), None
