"""The run itself: chunks of steps, decimated log, a stop where a state diverges."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.compiled.codegen.engine import Engine
from clie_blocks.compiled.runtime.events import Stop
from clie_blocks.compiled.runtime.inputs import Rows
from clie_blocks.errors import DivergedError
from clie_blocks.output import progress

if TYPE_CHECKING:
    import control as ct

CHUNK = 16384
PATIENCE = 2.0  # s without a progress line

Stopper = Callable[[float, np.ndarray], Stop | None]  # of time and record


@dataclass(frozen=True)
class Plan:
    """The length of a run, and what it logs.

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


@dataclass(frozen=True)
class Divergence:
    """Where a run diverged.

    Parameters
    ----------
    time : float
        Time of the first step that gave a state which is not finite [s].
    state : int
        That state.

    """

    time: float
    state: int


class DivergedRunError(DivergedError):
    """A state became infinite or NaN: when, where, and what was computed until then."""

    response: ct.TimeResponseData
    time: float
    block: str
    signal: str


@dataclass
class Log:
    """The rows of a run, and why it ended early.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Time [s].
    values : ndarray, shape (rows, entries)
        One row per time.
    divergence : Divergence or None
        The first state that is not finite.
    stop : Stop or None
        The stop condition that ended the run.

    """

    time: np.ndarray
    values: np.ndarray
    divergence: Divergence | None = None
    stop: Stop | None = None


def simulate(engine: Engine, plan: Plan, x: np.ndarray, p: np.ndarray, rows: Rows,
             label: str = "simulating", stopper: Stopper = lambda time, record: None) -> Log:
    """Run a program from time 0; `x` changes in place.

    The log is complete, or ends at the step that gave a state which is not finite, or at the step
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


def _stopped(engine: Engine, plan: Plan, x: np.ndarray, p: np.ndarray, u: np.ndarray, steps: int,
             log: np.ndarray, stopper: Stopper) -> Log:
    rows, end = -(-steps // plan.every), steps * plan.step
    record = engine.observe(end, x, u, p)
    log[rows] = record[plan.slots]
    return Log(np.append(np.arange(rows) * plan.every * plan.step, end), log[:rows + 1],
               stop=stopper(end, record))


def _diverged(engine: Engine, plan: Plan, x: np.ndarray, p: np.ndarray, inputs: np.ndarray,
              first: int, log: np.ndarray) -> Log:
    scratch = np.empty((1, plan.slots.size))
    for k in range(len(inputs)):
        engine.run(1, plan.step, 0.0, first + k, x, inputs[k:k + 1], p, plan.steps + 1,
                   plan.slots, scratch)
        if not np.all(np.isfinite(x)):
            break
    last = first + k
    kept = last // plan.every + 1
    return Log(np.arange(kept) * plan.every * plan.step, log[:kept],
               divergence=Divergence((last + 1) * plan.step, int(np.argmin(np.isfinite(x)))))


def patient_progress(stack: contextlib.ExitStack, label: str, total: int) -> Callable[[int], None]:
    """Return ``advance(done)``, which shows a progress line once the work takes long."""
    begun, shown = time.monotonic(), 0
    line: Callable[[float], None] | None = None

    def advance(done: int) -> None:
        nonlocal line, shown
        if line is None and time.monotonic() - begun > PATIENCE:
            line = stack.enter_context(progress(label, total))
        if line is not None:
            line(done - shown)
            shown = done
    return advance
