"""What differs between the runs of a batch: parameters and initial states, run by run."""

from dataclasses import dataclass

import numpy as np

from clie_blocks.compiled.runtime.arguments import block_states
from clie_blocks.labels import DiagramError


@dataclass(frozen=True)
class Sets:
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

    def __len__(self):
        return len(self.p)


def parameter_sets(parameters, params, states, initial_state, owner):
    """Arrange the parameters and initial states of every run.

    Parameters
    ----------
    parameters : Parameters
        Of the program.
    params : dict or None
        By key: a number for all runs, (N,) numbers, or (N, ...) of the parameter's shape.
    states : list of (str, str)
        Block and label of every state.
    initial_state : array_like, dict or None
        (states,) for all runs or (N, states); or such values by block.
    owner : str
        Name of the diagram, for messages.

    Raises
    ------
    DiagramError
        For unknown names, with the nearest valid one, and lengths that do not agree.

    """
    params = {key: _numbers(value, f"{owner}: parameter {key!r}")
              for key, value in (params or {}).items()}
    starts = initial_state if isinstance(initial_state, dict) else {None: initial_state}
    starts = {block: _numbers(value, f"{owner}: initial_state")
              for block, value in starts.items() if value is not None}
    runs = _count(params, starts, owner)
    p = np.tile(parameters.defaults, (runs, 1))
    own = np.zeros(parameters.defaults.size, bool)
    for key, value in params.items():
        slots = parameters.slots(key, owner)
        p[:, slots] = _per_run(key, value, parameters.shape[key], runs, owner)
        own[slots] = value.ndim > 0
    return Sets(p, own, _initial_states(states, starts, runs, owner))


def _numbers(value, what):
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise DiagramError(f"{what} must be numbers, got {value!r}") from None


def _count(params, starts, owner):
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


def _per_run(key, value, shape, runs, owner):
    if value.ndim == 1:
        value = value.reshape(-1, *[1] * len(shape))
    try:
        return np.broadcast_to(value, (runs, *shape)).reshape(runs, -1)
    except ValueError:
        raise DiagramError(f"{owner}: parameter {key!r} needs shape ({runs},) or "
                           f"{(runs, *shape)}, got {value.shape}") from None


def _initial_states(states, starts, runs, owner):
    x = np.zeros((runs, len(states)))
    for block, value in starts.items():
        where = slice(None) if block is None else block_states(states, block, owner)
        if value.ndim not in (1, 2) or value.shape[-1] != x[0, where].size:
            raise DiagramError(f"{owner}: initial_state{f' of {block!r}' if block else ''} needs "
                               f"{x[0, where].size} numbers per run, got shape {value.shape}")
        x[:, where] = value
    return x
