"""What is kept of a run that is too long to keep: means, squared errors, extrema, one's own.

A reduction sees the rows of a batch chunk by chunk, while they are computed, and forgets them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


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
    fold: Callable
    finish: Callable


def mean(signal, minus=None, start=0.0, end=np.inf):
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


def mean_square(signal, minus=None, start=0.0, end=np.inf):
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


def minimum(signal, minus=None, start=0.0, end=np.inf):
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


def maximum(signal, minus=None, start=0.0, end=np.inf):
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


def final(signal, minus=None, end=np.inf):
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


def integral(signal, minus=None, start=0.0, end=np.inf):
    """Integral over time in the window, by trapezia between the rows.

    Parameters
    ----------
    signal : str
        Base name or label.
    minus : str, optional
        Signal that is subtracted first.
    start, end : float
        The window [s], both ends included.

    """
    return Reduction(signal, minus, start, end, _trapezia, lambda state: state[0])


def fold(signal, function, finish=None, minus=None, start=0.0, end=np.inf):
    """A reduction of one's own.

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


def _total(state, time, values):
    total, count = state or (0.0, 0)
    return total + values.sum(axis=0), count + len(time)


def _average(state):
    return state[0] / state[1]


def _extremum(pick):
    def extremum(state, time, values):
        found = pick.reduce(values)
        return found if state is None else pick(state, found)
    return extremum


def _trapezia(state, time, values):
    if state is not None:
        time = np.concatenate([[state[1]], time])
        values = np.concatenate([state[2][None], values])
    trapezia = np.diff(time)[:, None, None] * (values[1:] + values[:-1]) / 2
    area = trapezia.sum(axis=0) + (0.0 if state is None else state[0])
    return area, time[-1], values[-1].copy()


def _as_it_is(state):
    return state
