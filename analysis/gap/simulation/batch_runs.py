"""Runs of one simulator side by side: sets of parameters in the lanes of the processor."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.labels import signals
from clie_blocks.processors import side_by_side
from clie_blocks.robot_loop.dynamics import Values

if TYPE_CHECKING:
    from clie_blocks.compiled.runtime.api import Batches

LANES, WIDE = 8, 16  # runs that fill one or two registers of any processor
KEPT_INPUTS = 8  # tables of inputs that are kept for the next run


class Shape(Protocol):
    """Joints and period of a simulated robot."""

    @property
    def n(self) -> int:
        """Number of joints."""

    @property
    def period(self) -> float:
        """Period of the controller [s]."""


class LaneSimulator(Protocol):
    """What a batch needs of a simulator."""

    @property
    def shape(self) -> Shape:
        """Joints and period."""

    @property
    def program(self) -> Batches:
        """The compiled program."""

    @property
    def threads(self) -> int | None:
        """Threads in which it may run; None for one per processor."""

    @property
    def delays(self) -> tuple[str, ...]:
        """Keys of the parameters that bound the delays of blocks [s]."""

    @property
    def drive_inputs(self) -> int:
        """Inputs of the loop for what the law reads of the drives."""

    @property
    def follows_record(self) -> bool:
        """Whether blocks of the drives read the recorded command."""

    def for_delays(self, longest: float) -> LaneSimulator:
        """Return the simulator with delay lines for a longest delay [s]."""

    def joint_start(self, log: Log, values: Values) -> np.ndarray:
        """Position of the joints at the first sample of a log [rad]."""

    def initial_state(self, log: Log, start: np.ndarray, values: Values) -> np.ndarray:
        """State at the first sample of a log, with the joints at a position [rad]."""


def batch_signals(simulator: LaneSimulator, log: Log, sets: Sequence[Values], names: Sequence[str],
                  dithered: bool = True, every: int = 1) -> np.ndarray:
    """Rows of some signals for many sets of parameters, in as many lanes as they fill.

    Parameters
    ----------
    simulator : LaneSimulator
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
    simulator = simulator.for_delays(longest_delay(simulator, sets))

    def run(group: tuple[Sequence[Values], int]) -> np.ndarray:
        some, width = group
        return _run_group(simulator, log, some, width, names, dithered, every)

    runs = side_by_side(run, _groups(sets, simulator.program.lanes), simulator.threads)
    return np.concatenate(runs) if len(runs) > 1 else runs[0]


def compile_batches(simulator: LaneSimulator, names: Sequence[str], parameters: Collection[str],
                    ) -> None:
    """Compile what batches of a few runs need that record some signals.

    Parameters
    ----------
    simulator : LaneSimulator
        The closed loop.
    names : tuple of str
        Signals, see `batch_signals`.
    parameters : collection of str
        Keys of the parameters that differ from run to run.

    """
    program = simulator.program
    program.compile(signals(*names, n=simulator.shape.n), parameters, _few(program.lanes))


def _groups(sets: Sequence[Values], lanes: int) -> Iterator[tuple[Sequence[Values], int]]:
    """Sets that run side by side, and in how many lanes: in all, or one register for a few.

    Two registers take half as long again as one.  A single run takes as many lanes as a few do:
    one lane would take two thirds of the time, and machine code of its own much longer.
    """
    few, first = _few(lanes), 0
    while first < len(sets):
        width = few if len(sets) - first <= few else lanes
        yield sets[first:first + width], width
        first += width


def _few(lanes: int) -> int:
    """Lanes of one register; one without machine code."""
    from clie_blocks.compiled.codegen.machine import register_width

    return min(register_width(), lanes) if lanes > 1 else 1


def longest_delay(simulator: LaneSimulator, sets: Sequence[Values]) -> float:
    """Return the longest delay of any set [s]; 0 where nothing delays."""
    return max((float(np.max(values[key])) for values in sets for key in simulator.delays),
               default=0.0)


def _run_group(simulator: LaneSimulator, log: Log, sets: Sequence[Values], width: int,
               names: Sequence[str], dithered: bool, every: int) -> np.ndarray:
    """Rows for at most `width` sets; idle lanes repeat the last, so that one code does."""
    filled = [*sets, *[sets[-1]] * (width - len(sets))]
    inputs, n = (_inputs(log, dithered, simulator.drive_inputs, simulator.follows_record),
                 simulator.shape.n)
    start = simulator.joint_start(log, sets[0])
    runs = simulator.program.batch(
        len(log) * simulator.shape.period, inputs=inputs,
        initial_state=simulator.initial_state(log, start, sets[0]),
        params={**{key: np.stack([values[key] for values in filled]) for key in sets[0]},
                "start": start[None], "first": inputs[:1, 2 * n:3 * n]},
        log=signals(*names, n=n), every=every, threads=1)
    return runs.outputs[:len(sets)]


@functools.lru_cache(maxsize=KEPT_INPUTS)
def _inputs(log: Log, dithered: bool, drive_inputs: int, follows_record: bool) -> np.ndarray:
    """Inputs of the loop in a log: q_d, pe, noise, those of the drive, commands, a logged supply.

    An experiment that was not made has no errors of the sensors of a drive.  Without its noise a
    position has the counts of its encoder still.
    """
    rounding = 0.0 * log.dither if log.rounding is None else log.rounding
    noise, of_drive = log.dither if dithered else rounding, np.zeros((len(log), drive_inputs))
    if drive_inputs and log.drive_rest is not None:
        of_drive = log.drive_rest + (log.drive_dither if dithered else 0.0)
    return np.hstack([log.q_d, log.pe, noise, of_drive,
                      *([log.supplied_u] if follows_record else []),
                      *([] if log.supply is None else [log.supply])])
