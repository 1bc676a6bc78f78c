"""The run itself: chunks of steps, decimated log, a stop where the state leaves the numbers."""

import contextlib
import time
from dataclasses import dataclass

import numpy as np

from clie_blocks.compiled.runtime.events import Stop
from clie_blocks.output import progress

CHUNK = 16384
PATIENCE = 2.0


@dataclass(frozen=True)
class Plan:
    """The numbers of a run.

    Parameters
    ----------
    steps, every : int
        Number of steps, and how many of them per row of the log.
    step : float
        Step [s].
    slots : ndarray of int64
        The entries of the record that are logged.

    """

    steps: int
    every: int
    step: float
    slots: np.ndarray


@dataclass
class Log:
    """What a run leaves: rows at every so many steps.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Time [s].
    values : ndarray, shape (rows, entries)
        One row per time.
    stopped_at : float or None
        Time of the first step that gave a state which is not finite.
    culprit : int or None
        That state.
    stop : Stop or None
        The stop condition that ended the run.

    """

    time: np.ndarray
    values: np.ndarray
    stopped_at: float | None = None
    culprit: int | None = None
    stop: Stop | None = None


def simulate(engine, plan, x, p, rows, label="simulating", stopper=lambda time, record: None):
    """Run a program from time 0.

    Parameters
    ----------
    engine : NativeEngine or PythonEngine
        The program.
    plan : Plan
        The numbers of the run.
    x : ndarray
        The initial state; changed in place.
    p : ndarray
        The parameters.
    rows : callable
        ``rows(count)`` gives the next input rows.
    label : str
        Text of the progress line.
    stopper : callable
        ``stopper(time, record)`` returns a `Stop` or None.

    Returns
    -------
    Log
        Complete, or up to the step that gave a state which is not finite, or up to the step
        that the program itself refused, as the last row.

    """
    log = np.empty((plan.steps // plan.every + 2, plan.slots.size))
    with contextlib.ExitStack() as stack:
        advance = patient_progress(stack, label, plan.steps)
        for first in range(0, plan.steps, CHUNK):
            count = min(CHUNK, plan.steps - first)
            before, inputs = x.copy(), np.ascontiguousarray(rows(count))
            taken = engine.run(count, plan.step, 0.0, first, x, inputs, p, plan.every,
                               plan.slots, log[-(-first // plan.every):])
            if not np.all(np.isfinite(x)):
                return _diverged(engine, plan, before, p, inputs, first, log)
            if taken < count:
                return _stopped(engine, plan, x, p, inputs[taken], first + taken, log, stopper)
            advance(first + count)
    # the row at the end is the first row of one step more, taken on a copy
    y, inputs = x.copy(), np.ascontiguousarray(rows(1))
    if not engine.run(1, plan.step, 0.0, plan.steps, y, inputs, p, plan.every, plan.slots,
                      log[-(-plan.steps // plan.every):]):
        return _stopped(engine, plan, y, p, inputs[0], plan.steps, log, stopper)
    kept = plan.steps // plan.every + 1
    return Log(np.arange(kept) * plan.every * plan.step, log[:kept])


def _stopped(engine, plan, x, p, u, steps, log, stopper):
    rows, end = -(-steps // plan.every), steps * plan.step
    record = engine.observe(end, x, u, p)
    log[rows] = record[plan.slots]
    return Log(np.append(np.arange(rows) * plan.every * plan.step, end), log[:rows + 1],
               stop=stopper(end, record))


def _diverged(engine, plan, x, p, inputs, first, log):
    scratch = np.empty((1, plan.slots.size))
    for k in range(len(inputs)):
        engine.run(1, plan.step, 0.0, first + k, x, inputs[k:k + 1], p, plan.steps + 1,
                   plan.slots, scratch)
        if not np.all(np.isfinite(x)):
            break
    last = first + k
    kept = last // plan.every + 1
    return Log(np.arange(kept) * plan.every * plan.step, log[:kept],
               stopped_at=(last + 1) * plan.step, culprit=int(np.argmin(np.isfinite(x))))


def patient_progress(stack, label, total):
    """Return ``advance(done)``, which shows a progress line once the work takes long.

    Parameters
    ----------
    stack : contextlib.ExitStack
        Closes the line.
    label : str
        Its text.
    total : int
        The amount of work.

    """
    begun, shown = time.monotonic(), {}

    def advance(done):
        if not shown and time.monotonic() - begun > PATIENCE:
            shown["line"], shown["done"] = stack.enter_context(progress(label, total)), 0
        if shown:
            shown["line"](done - shown["done"])
            shown["done"] = done
    return advance
