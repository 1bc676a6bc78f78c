"""Closed-loop simulation of the robot with the effects of a hypothesis, as machine code.

The program depends on the structure of a robot only, its parameters are arguments: the next robot
of the same structure runs without compilation.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation.batch_runs import batch_signals, compile_batches
from clie_blocks.compiled.cache.cached_program import cached_program, source_digest
from clie_blocks.errors import DivergedError
from clie_blocks.robot_loop.block import LoopBlock, Structure
from clie_blocks.robot_loop.dynamics import ActingCause, Values
from clie_blocks.robot_loop.pieces import Late, with_delay_line
from clie_blocks.robot_loop.sampled_law import PARAMETERS, TORQUE

if TYPE_CHECKING:
    from clie_blocks.compiled import Program
    from clie_blocks.compiled.cache.cached_program import CachedProgram

TAPS = 20  # samples of the shortest delay line, enough for most robots; others double it


def structure(problem: Problem) -> Structure:
    """Return the structure of a problem."""
    law = problem.law.block if isinstance(problem.law, BlockLaw) else None
    return Structure(problem.n, problem.period, problem.links.layout,
                     bool(np.isfinite(problem.law.saturation).all()),
                     problem.encoder_on_motor, problem.two_encoders, law,
                     any(log.supply is not None for log in problem.logs),
                     beside_record=law is not None and TORQUE in law.reads)


def constants(problem: Problem) -> dict[str, np.ndarray]:
    """Parameters of the simulator that are stated, by key."""
    law, nominal, links = problem.law, problem.nominal, problem.links
    values = {"inertia": nominal.inertia, "damping": nominal.damping, "load": nominal.load,
              "kp": law.kp, "kd": law.kd, "b": law.numerator, "a": law.denominator,
              "saturation": np.minimum(law.saturation, 1e9), "ratio": problem.gear_ratio}
    if isinstance(law, BlockLaw) and len(law.parameters):
        values[PARAMETERS] = law.parameters
    values.update({f"links.{name}": getattr(links, name) for name in links.parameters})
    return {key: np.array(value, float) for key, value in values.items()}


def _seen(log: Log) -> str:
    """Output that a log holds."""
    return "other" if log.of_other_encoder else "q"


@functools.lru_cache(maxsize=512)
def simulator(shape: Structure, causes: tuple[ActingCause, ...]) -> Simulator:
    """Simulator of a structure with some causes; compiled once."""
    pieces = tuple((cause.block, piece) for cause in causes for piece in cause.pieces)
    names = {cause.block: tuple(number.name for number in cause.numbers) for cause in causes}
    return Simulator(LoopBlock(shape, pieces, names))


@dataclasses.dataclass(frozen=True, eq=False)
class Simulator:
    """Closed loop of a robot with some effects; `run` gives measured positions and commands."""

    block: LoopBlock

    @property
    def shape(self) -> Structure:
        """Structure of the robot."""
        return self.block.shape

    @property
    def drive_inputs(self) -> int:
        """Inputs of the loop for what the law reads of the drives."""
        reads = self.shape.law.reads if self.shape.law else ()
        return self.shape.n * (len(reads) + self.shape.beside_record)

    @property
    def follows_record(self) -> bool:
        """Whether a block of the drives reads the recorded command beside those of the law."""
        return self.block.reads_record and not self.shape.beside_record

    @functools.cached_property
    def program(self) -> CachedProgram | Program:
        """The compiled program; an earlier process may have compiled it."""
        return cached_program(self.identity, lambda: self.block.system)

    @property
    def threads(self) -> int | None:
        """Threads in which it may run; one where blocks are called back."""
        return None if self.for_delays(0.0).program.lanes > 1 else 1

    @property
    def identity(self) -> str:
        """What decides the program: sources, structure, and how the pieces act."""
        acts = [(name, piece.identity) for name, piece in self.block.pieces]
        sources = source_digest(
            "clie_blocks.compiled", "clie_blocks.effects", "clie_blocks.robot_loop",
            "clie_blocks.analysis.gap")
        return "\n".join((sources, *map(repr, (self.shape, acts, self.block.parameter_names))))

    def run(self, log: Log, values: Values, dithered: bool = True,
            ) -> tuple[np.ndarray, np.ndarray]:
        """Positions as the sensor sees them, and commands of the model, shape (N, n) each.

        Raises
        ------
        DivergedError
            If the model diverges.
        """
        rows, = batch_signals(self, log, [values], (_seen(log), "u"), dithered)
        if not np.isfinite(rows).all():
            raise DivergedError(f"the model diverges in {log.name}: its closed loop is unstable "
                                "with these parameters")
        q, u = np.split(rows[:, :len(log)], 2)
        return q.T.copy(), u.T.copy()

    def positions(self, log: Log, sets: Sequence[Values], dithered: bool = True) -> np.ndarray:
        """Measured positions for many sets of parameters, shape (sets, n, N).

        A run that diverges is NaN.  Where fits take means, positions are the differences of the
        sums, for which the machine code exists.
        """
        n, sums = self.shape.n, log.stride == 1
        rows = batch_signals(self, log, sets, self._encoders(sums), dithered)
        with np.errstate(invalid="ignore"):  # a run that diverges goes on as NaN
            q = np.diff(rows) if sums else rows[..., :len(log)]
        return q[:, n:] if log.of_other_encoder else q[:, :n]

    def means(self, views: Sequence[Log], sets: Sequence[Values], width: int) -> list[np.ndarray]:
        """The same of the views of one run, averaged over `width` neighbouring samples.

        Each has shape (sets, n, N // width).  A tenth of the rows saves a quarter of the time,
        and both encoders at once half of it.
        """
        log, n = views[0], self.shape.n
        if log.stride > 1:
            samples = batch_signals(self, log, sets, self._encoders(False), every=log.stride)
            count = len(log) // (log.stride * width)
            means = samples[..., :count * width].reshape(
                *samples.shape[:-1], count, width).mean(axis=-1)
        else:
            rows = batch_signals(self, log, sets, self._encoders(True), every=width)
            with np.errstate(invalid="ignore"):
                means = np.diff(rows) / width
        return [means[:, n:] if view.of_other_encoder else means[:, :n] for view in views]

    def compile(self, parameters: Collection[str], sums: bool) -> None:
        """Compile what `means` runs, with these parameters run by run, before it is needed."""
        compile_batches(self, self._encoders(sums), parameters)

    def _encoders(self, sums: bool) -> tuple[str, ...]:
        """Signals of what all encoders of the joints read, or the sums of that."""
        names = ("sum", "sum_other") if sums else ("q", "other")
        return names[:1 + self.shape.two_encoders]

    def check(self, log: Log) -> None:
        """A stated loop runs with any log; its fit shows whether it diverges."""

    def joint_start(self, log: Log, values: Values) -> np.ndarray:
        """Position of the joints at which their encoder reads the start of a log [rad]."""
        return self.block.joint_at(log.start, values)

    def initial_state(self, log: Log, start: np.ndarray, values: Values) -> np.ndarray:
        """State at the first sample of a log: at rest, or in its motion."""
        return self.block.initial_state(start, log.speed, values, log.law_state)

    def for_delays(self, longest: float) -> Simulator:
        """Return the same simulator with delay lines that are long enough for a delay [s].

        What lies further back in a line is multiplied by zero, and moving it is most of a step.
        """
        samples = TAPS
        while samples * self.shape.period < longest * (1.0 - 1e-9):
            samples *= 2
        return self._with_delay_lines(samples) if self.delays else self

    @functools.cached_property
    def delays(self) -> tuple[str, ...]:
        """Keys of the parameters that bound the delays of pieces."""
        return tuple(f"{name}.{piece.act.longest}" for name, piece in self.block.pieces
                     if isinstance(piece.act, Late))

    def _with_delay_lines(self, samples: int) -> Simulator:
        if samples not in self._by_delay_lines:
            pieces = tuple((name, with_delay_line(piece, samples))
                           for name, piece in self.block.pieces)
            self._by_delay_lines[samples] = Simulator(
                dataclasses.replace(self.block, pieces=pieces))
        return self._by_delay_lines[samples]

    @functools.cached_property
    def _by_delay_lines(self) -> dict[int, Simulator]:
        """The simulator with the delay lines that it was asked for, by their samples."""
        return {}
