"""Arguments of a run, turned into arrays, with every mistake named."""

import fnmatch
import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import DiagramError, ports, vector


def count_steps(duration: float, step: float, every: int) -> int:
    """Return the number of steps of a run.

    Raises
    ------
    ClieError
        If the duration is not a multiple of the step, or a number makes no sense.

    """
    if not (np.isfinite(duration) and duration >= 0 and np.isfinite(step) and step > 0):
        raise ClieError(f"need a duration >= 0 s and a step > 0 s, got {duration!r}, {step!r}")
    if not (isinstance(every, (int, np.integer)) and every >= 1):
        raise ClieError(f"every must be a whole number of steps >= 1, got {every!r}")
    steps = round(duration / step)
    if abs(steps * step - duration) > 1e-6 * step * max(1, steps) ** 0.5:
        raise ClieError(f"the duration {duration:g} s is not a multiple of the step {step:g} s; "
                        f"use {steps * step:g} s")
    return steps


def state_vector(states: Sequence[tuple[str, str]],
                 initial_state: ArrayLike | Mapping[str, ArrayLike] | None,
                 owner: str) -> np.ndarray:
    """Return the initial state as a fresh vector.

    Raises
    ------
    DiagramError
        For an unknown block or a wrong length.

    """
    if initial_state is None:
        return np.zeros(len(states))
    if not isinstance(initial_state, Mapping):
        return vector(initial_state, f"{owner}: initial_state", n=len(states))
    x = np.zeros(len(states))
    for block, value in initial_state.items():
        where = block_states(states, block, owner)
        x[where] = vector(value, f"{owner}: initial_state of {block!r}", n=len(where))
    return x


def block_states(states: Sequence[tuple[str, str]], block: str, owner: str) -> list[int]:
    """Return where the states of a block lie.

    Raises
    ------
    DiagramError
        If no block with states has that name, with the nearest valid one.

    """
    where = [k for k, (name, _) in enumerate(states) if name == block]
    if not where:
        raise DiagramError(f"{owner}: no block with states is called {block!r}; "
                           f"{nearest(block, dict(states))}")
    return where


def select(signals: Sequence[str], log: str | Sequence[str], owner: str,
           kind: str = "signal") -> list[str]:
    """Return the signals that a log selects, each once, in the order of the log.

    Raises
    ------
    DiagramError
        For a name or pattern that fits none, with the nearest valid name.

    """
    groups: dict[str, list[int]] = ports(signals)
    chosen: dict[str, None] = {}
    for name in [log] if isinstance(log, str) else log:
        labels = [name] if name in signals else [signals[k] for k in groups.get(name, [])]
        if not labels and ("*" in name or "?" in name):
            labels = _matching(name, signals)
        if not labels:
            raise DiagramError(f"{owner}: no {kind} {name!r}; {nearest(name, groups)}")
        chosen |= dict.fromkeys(labels)
    return list(chosen)


def _matching(pattern: str, signals: Sequence[str]) -> list[str]:
    pattern = pattern.replace("[", "[[]")
    return [signal for signal in signals if fnmatch.fnmatchcase(signal, pattern)
            or fnmatch.fnmatchcase(re.sub(r"\[\d+\]$", "", signal), pattern)]
