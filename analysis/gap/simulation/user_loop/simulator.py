"""Any loop with causes joined at its ports: what the diagnosis simulates for ``loop=``.

In each step the causes read the motion of the loop and push back: dry friction as an impulse that
can stop a joint but never turn it round, a drive by the torque that it adds to the command, a
change of inertia, damping or constant load by the torque that it would make.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw
from clie_blocks.analysis.gap.problem.user_loop.ports import EXCITATION, REFERENCE, SENSOR
from clie_blocks.analysis.gap.simulation import dynamics as robot
from clie_blocks.analysis.gap.simulation.dynamics import (
    ActingCause,
    Memory,
    Parameters,
    Piece,
    State,
)
from clie_blocks.analysis.gap.simulation.user_loop.step import LoopStep
from clie_blocks.errors import ClieError, DivergedError

if TYPE_CHECKING:
    from control import NonlinearIOSystem

    from clie_blocks.compiled import Program

Values = Mapping[str, np.ndarray]  # parameters of the simulator by key
MODEL = ("inertia", "damping", "load")
FAR = 1e4  # times the range of the robot's motion
CALLED_BACK = re.compile(r"[;,] or have it called back, slowly: opaque=\[.*?\]")


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSimulator:
    """A loop with causes, with the methods of `closed_loop.Simulator`.

    Parameters
    ----------
    law : LoopLaw
        The loop and what is known of it.
    causes : tuple of Cause
        What is joined.

    """

    law: LoopLaw
    causes: tuple[ActingCause, ...]

    @functools.cached_property
    def program(self) -> Program:
        """The compiled program."""
        from clie_blocks.compiled import compile_diagram

        return compile_diagram(self.block)

    @functools.cached_property
    def block(self) -> NonlinearIOSystem:
        """The loop with its causes as a block in discrete time; outputs: q, u."""
        import control as ct

        from clie_blocks.signals import signals

        step, seen, n = self._step, self._seen, self.law.ports.n

        def update(t, x, u, params):
            return step(t, x, u, params)

        def output(t, x, u, params):
            return seen(t, x, u, params)

        return ct.nlsys(
            update, output, name="loop_with_causes", dt=self._moves.step,
            params={"inertia": self.law.inertia, "damping": self.law.damping,
                    "load": np.zeros(n), **{key: np.ones(n) for key in self._cause_keys}},
            states=[f"x[{k}]" for k in range(self._size)],
            inputs=list(self.law.diagram.input_labels), outputs=signals("q", "u", n=n))

    @functools.cached_property
    def _moves(self) -> LoopStep:
        return LoopStep.of(self.law.diagram, self.law.ports, self.law.period / self.law.substeps)

    @property
    def _pieces(self) -> list[tuple[str, Piece]]:
        return [(cause.block, piece) for cause in self.causes for piece in cause.pieces]

    @property
    def _size(self) -> int:
        """Length of the state: that of the loop, then the memories of the causes."""
        n = self.law.ports.n
        return self.law.diagram.nstates + n * sum(piece.states for _, piece in self._pieces)

    @property
    def _cause_keys(self) -> list[str]:
        return [f"{cause.block}.{number.name}" for cause in self.causes
                for number in cause.numbers]

    def _unpack(self, x: np.ndarray, params: Values) -> tuple[np.ndarray, Memory, dict[str, Any]]:
        n, at, memory = self.law.ports.n, self.law.diagram.nstates, {}
        for name, piece in self._pieces:
            memory.setdefault(name, [])
            if piece.states:
                memory[name] = [x[at + k * n:at + (k + 1) * n] for k in range(piece.states)]
                at += n * piece.states
        p = {cause.block: {number.name: params[f"{cause.block}.{number.name}"]
                           for number in cause.numbers} for cause in self.causes}
        p["damping"] = params["damping"] - self.law.damping
        p["load"] = params["load"]
        return x[:self.law.diagram.nstates], memory, p

    def _sensed(self, memory: Memory, p: Parameters) -> LoopStep:
        """Steps of the loop with what the causes add to the measured position."""
        moves = self._moves
        if not any(piece.port == "sensor" for _, piece in self._pieces):
            return moves

        def function(t, x, u):
            q, _ = moves.seen(t, x, u)
            wrong = robot.measured_position(q, memory, self._pieces, p, self.law.period)[0] - q
            return moves.function(t, x, moves.with_input(u, SENSOR, wrong))

        return dataclasses.replace(moves, function=function)

    def _seen(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        x, memory, p = self._unpack(x, params)
        return np.concatenate(self._sensed(memory, p).seen(t, x, u))

    def _step(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        x, memory, p = self._unpack(x, params)
        moves = self._sensed(memory, p)
        after = moves.free(t, x, u)
        pushed = moves.pushed(t, x, u, after)
        rate, late = moves.rate(t, x, u), moves.rate(t, after, u)
        answers = [moves.rate(t, after + change, u) - late for change in pushed]
        mass = moves.step * np.linalg.inv(np.stack(answers, axis=1))
        s = self._middle(moves, t, x, after, u, (rate + late) / 2)
        given, kept = robot.delivered_torque(s.u, memory, self._pieces, p, s.h)
        lost, remembered = robot.opposing_torque(s, memory, self._pieces, p)
        torque = self._torque(rate, late, mass, params, given - s.u - lost,
                              robot.dry_friction(s, self._pieces, p))
        kept.update(remembered)
        parts = [after + sum(torque[k] * change for k, change in enumerate(pushed))]
        for name, piece in self._pieces:
            parts += kept[name] if piece.states else []
        return np.concatenate(parts)

    def _middle(self, moves: LoopStep, t: float, x: np.ndarray, after: np.ndarray, u: np.ndarray,
                rate: np.ndarray) -> State:
        """Motion in the middle of a step; a loop in discrete time holds its command."""
        (q, command), (q_late, late) = moves.seen(t, x, u), moves.seen(t, after, u)
        h, n = moves.step, self.law.ports.n
        return State((q + q_late) / 2, rate, command if moves.discrete else (command + late) / 2,
                     t + h / 2, h, self.law.chain, np.ones(n))

    def _torque(self, rate: np.ndarray, late: np.ndarray, mass: np.ndarray, params: Values,
                push: np.ndarray, limits: tuple[np.ndarray, ...] | None) -> np.ndarray:
        """Torque over a step by which the joints move as the causes want [N m].

        `mass` is what the torque port feels, from the answer of the velocities to one N m.
        """
        n, h = self.law.ports.n, self._moves.step
        more = params["inertia"] - self.law.inertia
        own = np.stack([mass[k, k] + more[k] for k in range(n)])
        cross = mass if n > 1 else None
        forced = robot.acceleration(mass @ (late - rate) / h + push, own, cross)
        end = robot.velocity_after_friction(rate + h * forced, own, cross, limits, h)
        return mass @ (end - late) / h

    def run(self, log: Log, values: Values, dithered: bool = True,
            ) -> tuple[np.ndarray, np.ndarray]:
        """Positions and commands of the loop, shape (N, n) each."""
        response = self.program.run(**self._question(log), params=self._numbers(values))
        outputs, n = np.asarray(response.outputs)[:, :len(log)], self.law.ports.n
        return outputs[:n].T.copy(), outputs[n:].T.copy()

    def positions(self, log: Log, sets: Sequence[Values], dithered: bool = True) -> np.ndarray:
        """Positions for many sets of parameters, shape (sets, n, N)."""
        chosen = [self._numbers(values) for values in sets]
        params = {key: np.stack([values[key] for values in chosen]) for key in chosen[0]}
        done = self.program.batch(**self._question(log), params=params, threads=1,
                                  log=self.program.outputs[:self.law.ports.n])
        return done.outputs[:, :, :len(log)]

    def means(self, log: Log, sets: Sequence[Values], width: int) -> np.ndarray:
        """Positions for many sets, averaged over `width` neighbouring samples."""
        runs = self.positions(log, sets)
        rows = runs.shape[-1] // width
        return runs[..., :rows * width].reshape(*runs.shape[:2], rows, width).mean(axis=-1)

    def _numbers(self, values: Values) -> dict[str, np.ndarray]:
        """Parameters of the causes and the joints; those of the loop stay as they are."""
        return {key: values[key] for key in (*MODEL, *self._cause_keys)}

    def _question(self, log: Log) -> dict[str, Any]:
        law = self.law
        inputs = {REFERENCE: np.repeat(log.q_d, law.substeps, axis=0), law.ports.torque: 0.0}
        if law.ports.has_pe:
            inputs[EXCITATION] = np.repeat(log.pe, law.substeps, axis=0)
        quiet = (*law.ports.other, *((SENSOR,) if law.ports.has_sensor else ()))
        inputs.update({name: 0.0 for name in quiet})
        start = np.zeros(self._size)
        start[:law.diagram.nstates] = law.at_rest(log.start)
        return {"duration": len(log) * law.period, "inputs": inputs, "every": law.substeps,
                "initial_state": start}

    def check(self, log: Log) -> None:
        """Refuse a loop that diverges on a log, or that cannot become machine code.

        Raises
        ------
        ClieError
            If a block of the loop cannot be traced; names the block and the remedy.
        DivergedError
            If the loop's own motion becomes infinite, or leaves the robot's by far.

        """
        from clie_blocks.compiled import TraceError

        law = self.law
        try:
            q, _ = self.run(log, {"inertia": law.inertia, "damping": law.damping,
                                  "load": np.zeros(law.ports.n)})
        except TraceError as error:
            raise ClieError(f"{law.diagram.name}: the diagnosis runs a loop as machine code, and "
                            f"{CALLED_BACK.sub('', str(error))}") from error
        except DivergedError as error:
            raise _diverged(law, log) from error
        if np.abs(q - log.start).max() > FAR * max(np.ptp(log.q), np.ptp(log.q_d), 1e-6):
            raise _diverged(law, log)


def _diverged(law: LoopLaw, log: Log) -> DivergedError:
    return DivergedError(
        f"{law.diagram.name} diverges: fed with the reference and excitation of {log.name} it "
        f"leaves every bound, while the robot moves by {np.ptp(log.q):.3g} rad. Check signs, "
        "units and gains of the loop, and that no root or division in it meets a zero")
