"""Sparse regression of the residual torque, as SINDy does, by stepwise elimination.

The measured torque that the datasheet's model does not explain is regressed on the whole library
at once; the term whose removal costs least is dropped, one after the other, and BIC weighs the
models on that path (stepwise sparse regressor: Boninsegna, Nueske, Clementi 2018; model choice
along the path: Mangan, Kutz, Brunton, Proctor 2017).  Hard thresholds instead drop the right term
together with its alternatives: over a short travel the columns of a robot are nearly parallel.
The library holds each shape once: friction that contains plain dry friction enters with what it
adds.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.comparison.baselines.inverse_dynamics import (
    Shape,
    base_columns,
    best_shape,
    probe_columns,
    regress,
)
from clie_blocks.analysis.blind.comparison.baselines.model_selection import answer
from clie_blocks.analysis.blind.comparison.baselines.smoothed_motion import (
    net_command,
    parallel_filter,
    smooth_motions,
)
from clie_blocks.analysis.gap.problem.problem import Problem

REDUNDANT = ("asymmetric_coulomb",)  # dry friction and an offset, which the library holds


def sparse_regression(problem: Problem) -> dict[str, Any]:
    """Diagnose a robot by sparse regression of what its datasheet does not explain."""
    motions = smooth_motions(problem, problem.fit)
    target = parallel_filter(problem, [net_command(motion) for motion in motions])
    base, by_cause = base_columns(problem, motions), probe_columns(problem, motions)
    shapes = [best_shape(problem, target, base, group)[1] for key, group in by_cause.items()
              if key not in REDUNDANT]
    added = [_columns_beyond_simpler(shape) for shape in shapes]
    paths = [_elimination_path(target[:, k], base[:, :, k], [block[:, :, k] for block in added])
             for k in range(problem.n)]
    models = [regress(problem, target, base, shapes, _none_or_all(kept, shapes))
              for kept in zip(*paths)]
    distinct = {model.names: model for model in sorted(models, key=lambda m: -m.bic)}
    return answer(problem, list(distinct.values()))


def _none_or_all(kept: Sequence[tuple[int, ...]], shapes: Sequence[Shape],
                 ) -> Callable[[int], list[tuple[int, ...]]]:
    """Subsets of `regress` at joint k: nothing, or all causes that were kept there."""
    return lambda k: [(), _without_nested(kept[k], shapes)]


def _elimination_path(target: np.ndarray, base: np.ndarray,
                      blocks: Sequence[np.ndarray]) -> list[tuple[int, ...]]:
    """Positions of the causes kept, from all of them to none, by least loss of fit."""
    kept = list(range(len(blocks)))
    path = [tuple(kept)]
    while kept:
        losses = [_residual_sum(target, [base, *(blocks[i] for i in kept if i != out)])
                  for out in kept]
        kept.pop(int(np.argmin(losses)))
        path.append(tuple(kept))
    return path


def _residual_sum(target: np.ndarray, blocks: Sequence[np.ndarray]) -> float:
    matrix = np.concatenate(blocks).T
    residual = target - matrix @ np.linalg.lstsq(matrix, target, rcond=1e-8)[0]
    return float(residual @ residual)


def _columns_beyond_simpler(shape: Shape) -> np.ndarray:
    """Columns of a cause that the simpler cause within it does not have."""
    cause, probe, columns = shape
    beyond = [column for name, column in zip(probe.amplitudes, columns)
              if name in cause.without[1:]]
    return np.stack(beyond) if beyond else columns


def _without_nested(kept: Sequence[int], shapes: Sequence[Shape]) -> tuple[int, ...]:
    """Causes that were kept, without those that are contained in another one."""
    nested = {shapes[i].cause.without[0] for i in kept if shapes[i].cause.without}
    return tuple(i for i in kept if shapes[i].cause.name not in nested)
