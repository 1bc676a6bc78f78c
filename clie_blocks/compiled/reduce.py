"""Reductions of runs that are too long to store: mean, squared error, extremum, your own.

A reduction sees the rows of a batch chunk by chunk, while they are computed, and forgets them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

Fold = Callable[[Any, np.ndarray, np.ndarray], Any]  # of (state, time, values)


@dataclass(frozen=True)
class Reduction:
    """One number, or array, per run; made by the functions of this module.

    Parameters
    ----------
    signal : str
        Label, base name or pattern of what is reduced.
    minus : str or None
        What is subtracted from it first.
    start, end : float
        The window: rows from `start` to `end` [s], both included.
    fold : callable
        ``fold(state, time, values)`` returns the new state; `values` has the shape
        (rows, signals, runs), and the state is None at first.
    finish : callable
        The result of the last state: an array whose last axis is runs.

    """

    signal: str
    minus: str | None
    start: float
    end: float
    fold: Fold
    finish: Callable[[Any], np.ndarray]


def mean(signal: str, minus: str | None = None, start: float = 0.0,
         end: float = np.inf) -> Reduction:
    """Mean over the window, row by row.

    Parameters
    ----------
    signal : str
        Base name (``'q'``) or label (``'q[0]'``).
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, _total, _average)


def mean_square(signal: str, minus: str | None = None, start: float = 0.0,
                end: float = np.inf) -> Reduction:
    """Mean square over the window; with `minus`, the mean squared error.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end,
                     lambda state, time, values: _total(state, time, values * values), _average)


def minimum(signal: str, minus: str | None = None, start: float = 0.0,
            end: float = np.inf) -> Reduction:
    """Least value in the window.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, _extremum(np.minimum), _as_it_is)


def maximum(signal: str, minus: str | None = None, start: float = 0.0,
            end: float = np.inf) -> Reduction:
    """Greatest value in the window.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, _extremum(np.maximum), _as_it_is)


def final(signal: str, minus: str | None = None, end: float = np.inf) -> Reduction:
    """Value of the last row up to `end`.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted.
    end : float
        Latest time [s].

    """
    return Reduction(signal, minus, 0.0, end, lambda state, time, values: values[-1].copy(),
                     _as_it_is)


def integral(signal: str, minus: str | None = None, start: float = 0.0,
             end: float = np.inf) -> Reduction:
    """Integral over time in the window, by the trapezoidal rule.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, _trapezoids, lambda state: state[0])


def fold(signal: str, function: Fold, finish: Callable[[Any], np.ndarray] | None = None,
         minus: str | None = None, start: float = 0.0, end: float = np.inf) -> Reduction:
    """Your own reduction.

    Parameters
    ----------
    signal : str
        Base name or label.
    function : callable
        ``function(state, time, values)`` returns the new state; `time` is (rows,), `values`
        (rows, signals, runs) and must not be kept, the state is None at first.  It runs in
        several threads, each with a state of its own.
    finish : callable, optional
        Turns the last state into an array whose last axis is runs; by default the state is one.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, function, finish or _as_it_is)


def _total(state: Any, time: np.ndarray, values: np.ndarray) -> tuple:
    total, count = state or (0.0, 0)
    return total + values.sum(axis=0), count + len(time)


def _average(state: Any) -> np.ndarray:
    return state[0] / state[1]


def _extremum(pick: np.ufunc) -> Fold:
    def extremum(state: Any, time: np.ndarray, values: np.ndarray) -> np.ndarray:
        value = pick.reduce(values)
        return value if state is None else pick(state, value)
    return extremum


def _trapezoids(state: Any, time: np.ndarray, values: np.ndarray) -> tuple:
    if state is not None:
        time = np.concatenate([[state[1]], time])
        values = np.concatenate([state[2][None], values])
    trapezoids = np.diff(time)[:, None, None] * (values[1:] + values[:-1]) / 2
    area = trapezoids.sum(axis=0) + (0.0 if state is None else state[0])
    return area, time[-1], values[-1].copy()


def _as_it_is(state: Any) -> Any:
    return state
