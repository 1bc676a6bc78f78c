"""Parameters of a law that runs as a block, found from the logged commands.

Those that give the commands are found from all logs together, and of them as few are changed as
the commands need.
"""

import dataclasses
from collections.abc import Callable, Collection, Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples
from clie_blocks.analysis.gap.controller.other_laws import replay_error
from clie_blocks.analysis.gap.controller.refit import with_law_states
from clie_blocks.analysis.gap.controller.replay import LawParameter
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import STATE_STEP, BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import MOST_OF_POSITION, ROUNDED_STEPS

DECIMALS, WHOLE, FIRST_ROWS = range(2, 11), 1e-4, 5000  # of references that are rounded
ROWS = 4000  # of each log, evenly apart, by which parameters are found
EVALUATIONS = 30  # in which they are found; a law that is linear in them takes two
TINY = np.finfo(float).tiny
HUGE = 1e60  # N m: the command of a law that diverges
HALVINGS = 6  # of a step that does not help, at most
ENOUGH = 1e-9  # of what a step removes of the squares that are left: the last one
STEP = 1e-5  # of a parameter, in the differences by which it is found
LEAST_SIZE = 1e-3  # of a parameter that is stated as zero
RANK = 1e-10  # of the largest singular value: below it, states do not show in the commands
ALIKE = 1e-7  # likewise, below it a mixture of parameters does not; differences are no finer
STATE_ROUNDS = 2  # steps in which the first state is found; a linear law takes one
DIVERGED = 1e6  # limits that a law counts to leave under parameters with which it diverges
MOST_LEVELS = 100  # values of a reference that does not follow a course
CERTAIN = 5.0  # half widths by which a parameter that ran differs from the stated one


def error_of(problem: Problem, law: BlockLaw) -> np.ndarray:
    """Replay error of a law that begins in the states that its own commands show, shape (n,)."""
    return replay_error(with_law_states(problem, law), law)


def with_rounded_reference(problem: Problem, law: BlockLaw, limit: np.ndarray) -> np.ndarray:
    """Largest RMS that rounding explains, with that of the logged references, shape (n,) [N m].

    A law with the acceleration of its reference makes much of the last digit.  A reference that
    rests, or steps between a few values, has few digits because it was set so.
    """
    step = max((decimal_step(q_d) for log in problem.logs for q_d in log.q_d.T
                if len(np.unique(q_d)) > MOST_LEVELS), default=0.0)
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


def with_parameters_that_ran(problem: Problem, start: BlockLaw, limit: np.ndarray,
                             joints: Sequence[int] | None = None,
                             stated: np.ndarray | None = None, held: Collection[str] = (),
                             ) -> tuple[BlockLaw, tuple[LawParameter, ...]]:
    """Law with the parameters that leave least, and those of them that had to change.

    Parameters
    ----------
    problem : Problem
        Whose commands count.
    start : BlockLaw
        With parameters from which they are found.
    limit : ndarray, shape (n,)
        Largest RMS that rounding explains [N m].
    joints : sequence of int, optional
        Joints whose parameters may change; by default all.
    stated : ndarray, shape (m,), optional
        Parameters that count as unchanged; by default those of `start`.
    held : collection of str
        Keys of parameters that stay as they are.

    """
    stated = start.parameters if stated is None else stated
    law, half = fitted(problem, start, limit, free_parameters(problem, start, joints, held))
    limit = with_rounded_reference(problem, law, limit)
    changed = np.flatnonzero(np.abs(law.parameters - stated) > CERTAIN * half)
    parameters = stated.copy()
    parameters[changed] = law.parameters[changed]
    fewer, half_of_fewer = fitted(problem, with_numbers_only(law, parameters), limit, changed)
    if np.all((error_of(problem, fewer) <= limit) | (error_of(problem, law) > limit)):
        law, half = fewer, half_of_fewer
    return start.with_parameters(law.parameters), tuple(
        LawParameter(*name_of(problem, start, k), float(law.parameters[k]), float(half[k]),
                     float(stated[k]))
        for k in np.flatnonzero(law.parameters != stated).tolist())


def free_parameters(problem: Problem, law: BlockLaw, joints: Sequence[int] | None,
                    held: Collection[str] = ()) -> np.ndarray:
    """Places of the parameters of some joints, or of all, and of those of no joint.

    Those whose keys are `held` are not among them.
    """
    of_joint = [name_of(problem, law, k)[1] for k in range(len(law.parameters))]
    return np.array([k for k, joint in enumerate(of_joint)
                     if (joints is None or joint is None or joint in joints)
                     and law.block.parameters[k][0] not in held], int)


def with_numbers_only(law: BlockLaw, parameters: np.ndarray) -> BlockLaw:
    """Law with other parameters, for a replay: its linearisation stays as it was."""
    return dataclasses.replace(law, parameters=parameters)


def fitted(problem: Problem, start: BlockLaw, limit: np.ndarray, free: np.ndarray,
           evaluations: int = EVALUATIONS) -> tuple[BlockLaw, np.ndarray]:
    """Law whose free parameters leave least of the commands, and half the width of each."""
    half = np.zeros(len(start.parameters))
    if not len(free):
        return start, half
    size = np.maximum(np.abs(start.parameters[free]), LEAST_SIZE)

    def parameters(change: np.ndarray) -> np.ndarray:
        changed = start.parameters.copy()
        changed[free] += size * change
        return changed

    def regression(change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        parts = [_regression(log, start, parameters(change), free, size, limit)
                 for log in problem.logs]
        columns, left = zip(*parts)
        return np.concatenate(columns), np.concatenate(left)

    change, columns = _gauss_newton(regression, len(free), evaluations)
    scale = np.linalg.norm(columns, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = columns / scale
    variance = np.diag(np.linalg.pinv(scaled.T @ scaled)) / scale**2
    half[free] = size * np.sqrt(np.maximum(variance, 0.0))
    return with_numbers_only(start, parameters(change)), half


def _gauss_newton(regression: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], count: int,
                  evaluations: int) -> tuple[np.ndarray, np.ndarray]:
    """Change that leaves least, by steps that are halved until they help, and the slopes there.

    A law that is linear in its parameters takes one step, however far they are.
    """
    change = np.zeros(count)
    columns, left = regression(change)
    evaluations -= 1
    while evaluations > 0:
        scale = np.linalg.norm(columns, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        step = np.linalg.lstsq(columns / scale, left, rcond=ALIKE)[0] / scale
        for _ in range(HALVINGS):
            after = regression(change + step)
            evaluations -= 1
            gain = 1.0 - (np.linalg.norm(after[1]) / max(np.linalg.norm(left), TINY)) ** 2
            if gain > 0.0 or evaluations <= 0:
                break
            step = 0.5 * step
        if not gain > 0.0:
            break
        change, (columns, left) = change + step, after
        if gain < ENOUGH:
            break
    return change, columns


def rms_left(problem: Problem, law: BlockLaw) -> np.ndarray:
    """RMS that a law leaves of the commands from its likeliest first state, shape (n,) [N m]."""
    one = np.ones(law.block.n)
    none = np.zeros(0, int)
    parts = [_regression(log, law, law.parameters, none, np.zeros(0), one)[1].reshape(
        -1, law.block.n) for log in problem.logs]
    return np.max([np.sqrt(np.mean(part**2, axis=0)) for part in parts], axis=0)


def _regression(log: Log, law: BlockLaw, parameters: np.ndarray, free: np.ndarray,
                size: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the commands in a log by parameters, and what the law leaves, per limit.

    Both are those of the first state that leaves least under these parameters: a filter that
    began with the memory of another one has a transient, which would hide their slopes.
    """
    every = max(1, len(log) // ROWS)
    usable = (np.abs(log.u) < law.saturation) & known_samples(log, law)[:, None]
    weight = np.where(usable, 1.0 / limit, 0.0)[::every]

    inputs = law.inputs_of(log)

    def changes(states: list[np.ndarray], of: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """What the first run leaves, and by how much the others differ from it."""
        runs = law.run(inputs, states, of, every)
        if not np.abs(runs).max(initial=0.0) < HUGE:  # or NaN
            return np.full(runs[0].size, DIVERGED), np.zeros((runs[0].size, len(runs) - 1))
        left = ((log.u[::every] - runs[0]) * weight).ravel()
        return left, ((runs[1:] - runs[0]) * weight).reshape(len(runs) - 1, runs[0].size).T

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


def name_of(problem: Problem, law: BlockLaw, k: int) -> tuple[str, int | None]:
    """Name of a parameter, and its joint where it has one value per joint."""
    key, place = law.block.parameters[k]
    count = sum(one == key for one, _ in law.block.parameters)
    if count == problem.n:
        return key, place
    return (key if count == 1 else f"{key}[{place}]"), None
