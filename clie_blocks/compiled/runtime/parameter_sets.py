"""What differs between the runs of a batch: parameters and initial states, run by run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.runtime.arguments import block_states
from clie_blocks.labels import DiagramError


@dataclass(frozen=True)
class ParameterSets:
    """The parameters and initial states of every run.

    Parameters
    ----------
    p : ndarray, shape (N, entries)
        The parameters.
    own : ndarray of bool, shape (entries,)
        Which of them may differ between runs.
    x : ndarray, shape (N, states)
        The initial states.

    """

    p: np.ndarray
    own: np.ndarray
    x: np.ndarray

    def __len__(self) -> int:
        return len(self.p)


def parameter_sets(parameters: Parameters, params: Mapping[str, ArrayLike] | None,
                   states: Sequence[tuple[str, str]],
                   initial_state: ArrayLike | Mapping[str, ArrayLike] | None,
                   owner: str) -> ParameterSets:
    """Arrange the parameters and initial states of every run.

    Raises
    ------
    DiagramError
        For unknown names, with the nearest valid one, and lengths that do not agree.

    """
    values = {key: _numbers(value, f"{owner}: parameter {key!r}")
              for key, value in (params or {}).items()}
    by_block: Mapping[Any, Any] = (initial_state if isinstance(initial_state, Mapping)
                                   else {None: initial_state})
    starts = {block: _numbers(value, f"{owner}: initial_state")
              for block, value in by_block.items() if value is not None}
    runs = _count(values, starts, owner)
    p = np.tile(parameters.defaults, (runs, 1))
    own = np.zeros(parameters.defaults.size, bool)
    for key, value in values.items():
        slots = parameters.slots(key, owner)
        p[:, slots] = _per_run(key, value, parameters.shape[key], runs, owner)
        own[slots] = value.ndim > 0
    return ParameterSets(p, own, _initial_states(states, starts, runs, owner))


def _numbers(value: ArrayLike, what: str) -> np.ndarray:
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise DiagramError(f"{what} must be numbers, got {value!r}") from None


def _count(params: Mapping[str, np.ndarray], starts: Mapping[str | None, np.ndarray],
           owner: str) -> int:
    lengths = {f"parameter {key!r}": len(value) for key, value in params.items() if value.ndim}
    lengths |= {f"initial_state of {block or 'all blocks'}": len(value)
                for block, value in starts.items() if value.ndim > 1}
    runs = max(lengths.values(), default=1)
    for name, length in lengths.items():
        if length not in (1, runs):
            raise DiagramError(f"{owner}: {name} has {length} values for {runs} runs; the first "
                               "axis counts runs, so one vector for all of them is [[...]]")
    if not runs:
        raise DiagramError(f"{owner}: a batch of no runs; give at least one value per parameter")
    return runs


def _per_run(key: str, value: np.ndarray, shape: tuple[int, ...], runs: int,
             owner: str) -> np.ndarray:
    if value.ndim == 1:
        value = value.reshape(-1, *[1] * len(shape))
    try:
        return np.broadcast_to(value, (runs, *shape)).reshape(runs, -1)
    except ValueError:
        raise DiagramError(f"{owner}: parameter {key!r} needs shape ({runs},) or "
                           f"{(runs, *shape)}, got {value.shape}") from None


def _initial_states(states: Sequence[tuple[str, str]], starts: Mapping[str | None, np.ndarray],
                    runs: int, owner: str) -> np.ndarray:
    x = np.zeros((runs, len(states)))
    for block, value in starts.items():
        where = slice(None) if block is None else block_states(states, block, owner)
        if value.ndim not in (1, 2) or value.shape[-1] != x[0, where].size:
            raise DiagramError(f"{owner}: initial_state{f' of {block!r}' if block else ''} needs "
                               f"{x[0, where].size} numbers per run, got shape {value.shape}")
        x[:, where] = value
    return x
