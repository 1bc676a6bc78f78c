"""Runs of one simulator side by side: sets of parameters in the lanes of the processor."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.labels import signals

if TYPE_CHECKING:
    from clie_blocks.compiled.runtime.api import Batches

Values = Mapping[str, np.ndarray]  # parameters of the simulator by key


class Shape(Protocol):
    """Joints and period of a simulated robot."""

    @property
    def n(self) -> int: ...  # noqa: D102

    @property
    def period(self) -> float: ...  # noqa: D102


class LaneSimulator(Protocol):
    """What a batch asks of a simulator."""

    @property
    def shape(self) -> Shape: ...  # noqa: D102

    @property
    def program(self) -> Batches: ...  # noqa: D102

    @property
    def delays(self) -> tuple[str, ...]: ...  # noqa: D102

    def for_delays(self, longest: float) -> LaneSimulator: ...  # noqa: D102

    def start(self, log: Log, values: Values) -> np.ndarray: ...  # noqa: D102

LANES, WIDE = 8, 16  # runs side by side: two registers of them take half as long again as one
KEPT = 8  # tables of inputs


def batch_signals(simulator: LaneSimulator, log: Log, sets: Sequence[Values], names: Sequence[str],
                  dithered: bool = True, every: int = 1) -> np.ndarray:
    """Rows of some signals for many sets of parameters, in as many lanes as they fill.

    Parameters
    ----------
    simulator : Simulator
        The closed loop.
    log : Log
        Reference, excitation, noise and start.
    sets : list of dict
        Parameters by key.
    names : tuple of str
        Signals: ``q``, ``u``, or ``sum``, the sum of all q before.
    dithered : bool
        The measured noise of the log goes round the loop.
    every : int
        Samples per row.

    Returns
    -------
    ndarray, shape (sets, names x n, rows)
        One row more than the log has; those of a run that diverges end in NaN.

    """
    simulator = simulator.for_delays(_longest_delay(simulator, sets))
    width = min(_width(len(sets), every), simulator.program.lanes)
    found = [_group(simulator, log, sets[first:first + width], width, names, dithered, every)
             for first in range(0, len(sets), width)]
    return np.concatenate(found) if len(found) > 1 else found[0]


def _width(count: int, every: int) -> int:
    """Lanes for so many sets.

    A lone run of every sample takes one, at two thirds of the time; one of means takes as many
    as slopes do, whose code is there.
    """
    return 1 if count == 1 and every == 1 else LANES if count <= LANES else WIDE


def _longest_delay(simulator: LaneSimulator, sets: Sequence[Values]) -> float:
    """Longest delay of any set [s]; 0 where nothing delays."""
    keys = [f"{name}.time" for name in simulator.delays]
    return max((float(np.max(values[key])) for values in sets for key in keys), default=0.0)


def _group(simulator: LaneSimulator, log: Log, sets: Sequence[Values], width: int,
           names: Sequence[str], dithered: bool, every: int) -> np.ndarray:
    """Rows for at most `width` sets; idle lanes repeat the last, so that one code does."""
    filled = [*sets, *[sets[-1]] * (width - len(sets))]
    inputs = _inputs(log, dithered)
    done = simulator.program.batch(
        len(log) * simulator.shape.period, inputs=inputs,
        initial_state=simulator.start(log, sets[0]),
        params={**{key: np.stack([values[key] for values in filled]) for key in sets[0]},
                "start": log.start[None], "first": inputs[:1, 2 * simulator.shape.n:]},
        log=signals(*names, n=simulator.shape.n), every=every, threads=1)
    return done.outputs[:len(sets)]


@functools.lru_cache(maxsize=KEPT)
def _inputs(log: Log, dithered: bool) -> np.ndarray:
    """Inputs of the loop in a log: q_d, pe, noise."""
    return np.hstack([log.q_d, log.pe, log.dither if dithered else 0.0 * log.dither])
