"""Textbook inverse-dynamics least squares, with BIC over sets of regressors.

Positions are smoothed without phase and differentiated, torque and regressors pass the same
8 Hz filter, are thinned to its bandwidth, and one linear regression per joint follows.  The
regressors are the opposing torques of the vocabulary that the measured motion determines; what
needs a state, a delay or the inside of the drive is out of reach of this method.
"""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from clie_blocks.analysis.blind.comparison.baselines.model_selection import Model, answer, bic
from clie_blocks.analysis.blind.comparison.baselines.smoothed_motion import (
    SmoothedMotion,
    Values,
    motion_scene,
    net_command,
    opposing_torque,
    parallel_filter,
    regressors,
    smooth_motions,
)
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause, Probe
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.problem.problem import Problem

LEADERS = 6  # causes that enter the search over pairs


class Shape(NamedTuple):
    """A cause at one point of its search grid, with its columns, shape (amplitudes, N, n)."""

    cause: Cause
    probe: Probe
    columns: np.ndarray


def inverse_dynamics(problem: Problem) -> dict[str, Any]:
    """Diagnose a robot by regression of its torque on the measured motion."""
    motions = smooth_motions(problem, problem.fit)
    target = parallel_filter(problem, [net_command(motion) for motion in motions])
    base = base_columns(problem, motions)
    nominal = regress(problem, target, base, ())
    singles = [best_shape(problem, target, base, shapes)
               for shapes in probe_columns(problem, motions).values()]
    singles.sort(key=lambda single: single[0].bic)
    pairs = [regress(problem, target, base, (one, two)) for (_, one), (_, two)
             in itertools.combinations(singles[:LEADERS], 2)]
    return answer(problem, [nominal, *(model for model, _ in singles), *pairs])


def best_shape(problem: Problem, target: np.ndarray, base: np.ndarray,
               shapes: Iterable[Shape]) -> tuple[Model, Shape]:
    """Model of one cause in the shape that fits best, and that shape."""
    models = [(regress(problem, target, base, (shape,)), shape) for shape in shapes]
    return min(models, key=lambda one: one[0].bic)


def base_columns(problem: Problem, motions: Sequence[SmoothedMotion]) -> np.ndarray:
    """Filtered acceleration, velocity and one, shape (3, N, n)."""
    return np.stack([parallel_filter(problem, x) for x in (
        [m.ddq for m in motions], [m.state.dq for m in motions],
        [np.ones_like(m.ddq) for m in motions])])


def probe_columns(problem: Problem, motions: Sequence[SmoothedMotion]) -> dict[str, list[Shape]]:
    """Return the shapes of every cause in reach, by its key."""
    sizes, by_cause = motion_scene(problem, motions), {}
    for cause in regressors(problem, CAUSES):
        shapes = [Shape(cause, probe, _columns(problem, motions, cause, probe))
                  for probe in cause.probes(sizes)]
        if shapes:
            by_cause[cause.key] = shapes
    return by_cause


def _columns(problem: Problem, motions: Sequence[SmoothedMotion], cause: Cause,
             probe: Probe) -> np.ndarray:
    """Filtered torque of a probe, with one of its amplitudes at a time."""
    sets = [{name: value if active in (None, name) or name not in probe.amplitudes
             else 0.0 * value for name, value in probe.values.items()}
            for active in probe.amplitudes or (None,)]
    return np.stack([parallel_filter(problem, [
        opposing_torque(motion, cause, _of_log(values, j)) for j, motion in enumerate(motions)])
        for values in sets])


def _of_log(values: Values, j: int) -> Values:
    return {name: value[j] if np.ndim(value) == 2 else value for name, value in values.items()}


def regress(problem: Problem, target: np.ndarray, base: np.ndarray, shapes: Sequence[Shape],
            subsets: Callable[[int], Iterable[tuple[int, ...]]] | None = None) -> Model:
    """Fit some causes at all joints, and leave them out where BIC does.

    Parameters
    ----------
    problem : Problem
        The robot.
    target : ndarray, shape (N, n)
        Filtered torque.
    base : ndarray, shape (3, N, n)
        See `base_columns`.
    shapes : sequence of Shape
        The causes.
    subsets : callable, optional
        ``subsets(k)`` lists what may act at joint k, as positions in shapes; by default anything.

    """
    subsets = subsets or (lambda k: _subsets(len(shapes)))
    n, total = problem.n, 0.0
    joint_model = np.zeros((3, n))
    amplitudes = [np.zeros((len(shape.columns), n)) for shape in shapes]
    used: list[set[int]] = [set() for _ in shapes]
    for k in range(n):
        score, theta, subset = min(((*_fit_joint(target[:, k], base[:, :, k], [
            shapes[i] for i in subset], k), subset) for subset in subsets(k)),
            key=lambda one: one[0])
        total += score
        joint_model[:, k] = theta[:3]
        at = 3
        for i in subset:
            width = len(amplitudes[i])
            amplitudes[i][:, k] = theta[at:at + width]
            used[i].add(k)
            at += width
    members = tuple(_member(shape, amplitude, sorted(joints))
                    for shape, amplitude, joints in zip(shapes, amplitudes, used) if joints)
    inertia, damping, load = joint_model
    return Model(members, total, {"inertia": np.maximum(inertia, 0.2 * problem.nominal.inertia),
                                  "damping": np.maximum(damping, 0.0), "load": load})


def _subsets(causes: int) -> Iterator[tuple[int, ...]]:
    """Subsets of the causes of a model, as positions; the empty one comes first."""
    for count in range(causes + 1):
        yield from itertools.combinations(range(causes), count)


def _fit_joint(target: np.ndarray, base: np.ndarray, shapes: Sequence[Shape],
               k: int) -> tuple[float, np.ndarray]:
    """BIC and parameters of joint k with some causes; infinite where one has no meaning."""
    matrix = np.concatenate([base, *(shape.columns[:, :, k] for shape in shapes)]).T
    theta = np.linalg.lstsq(matrix, target, rcond=None)[0]
    lower = np.concatenate([np.zeros(2), [-np.inf], *(_lower_bounds(shape) for shape in shapes)])
    if np.any(theta < lower):
        return (np.inf if shapes else 1e300), theta
    residual = target - matrix @ theta
    return bic(residual @ residual, len(target), len(theta)), theta


def _lower_bounds(shape: Shape) -> list[float]:
    numbers = {number.name: number for number in shape.cause.numbers}
    return [0.0 if numbers[name].lower == 0.0 else -np.inf
            for name in shape.probe.amplitudes] or [0.0]


def _member(shape: Shape, amplitude: np.ndarray, joints: Sequence[int]) -> Member:
    values = {name: np.array(value, float) for name, value in shape.probe.values.items()}
    for name, factor in zip(shape.probe.amplitudes, amplitude):
        values[name] = values[name] * factor
    return Member(shape.cause, tuple(joints), values, shape.probe.values)
