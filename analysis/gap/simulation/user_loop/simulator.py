"""Any loop with causes joined at its ports: what the diagnosis simulates for ``loop=``.

In each step the causes read the motion of the loop and act on it: dry friction as an impulse that
can stop a joint but never reverse it, a drive by the torque that it adds to the command, a change
of inertia, damping or constant load by the torque that it would make.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw
from clie_blocks.analysis.gap.problem.user_loop.ports import EXCITATION, REFERENCE, SENSOR
from clie_blocks.analysis.gap.simulation.user_loop.step import LoopStep
from clie_blocks.errors import ClieError, DivergedError
from clie_blocks.robot_loop.dynamics import (
    ActingCause,
    Memory,
    NamedPieces,
    Parameters,
    State,
    Values,
    acceleration,
    delivered_torque,
    dry_friction,
    measured_position,
    opposing_torque,
    velocity_after_friction,
)
from clie_blocks.robot_loop.state_layout import StateLayout, rows_of_pieces

if TYPE_CHECKING:
    from control import NonlinearIOSystem

    from clie_blocks.compiled import Program

MODEL = ("inertia", "damping", "load")
_SENSOR_STEPS = 3  # the error of a sensor is small and smooth: each step leaves its square
FARTHEST_MOTION = 1e4  # times the range of the robot's motion: a loop that moves farther diverges


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSimulator:
    """A loop with causes, with the methods of `closed_loop.Simulator`.

    Parameters
    ----------
    law : LoopLaw
        The loop and what is known of it.
    causes : tuple of ActingCause
        What is joined.

    """

    law: LoopLaw
    causes: tuple[ActingCause, ...]
    threads: ClassVar[int] = 1  # the blocks of a user may not expect several

    @functools.cached_property
    def program(self) -> Program:
        """The compiled program."""
        from clie_blocks.compiled import compile_diagram

        return compile_diagram(self.system)

    @functools.cached_property
    def system(self) -> NonlinearIOSystem:
        """The loop with its causes as a block in discrete time; outputs: q, u."""
        import control as ct

        from clie_blocks.labels import signals

        step, measure, n = self._step, self._outputs, self.law.ports.n

        def update(t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
            return step(t, x, u, params)

        def output(t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
            return measure(t, x, u, params)

        return ct.nlsys(
            update, output, name="loop_with_causes", dt=self._loop.step,
            params={"inertia": self.law.inertia, "damping": self.law.damping,
                    "load": np.zeros(n), **{key: np.ones(n) for key in self._cause_keys}},
            states=[f"x[{k}]" for k in range(self._layout.size)],
            inputs=list(self.law.diagram.input_labels), outputs=signals("q", "u", n=n))

    @functools.cached_property
    def _loop(self) -> LoopStep:
        return LoopStep.of(self.law.diagram, self.law.ports, self.law.period / self.law.substeps)

    @functools.cached_property
    def _pieces(self) -> NamedPieces:
        return [(cause.block, piece) for cause in self.causes for piece in cause.pieces]

    @functools.cached_property
    def _layout(self) -> StateLayout:
        """State of the loop, then the memories of the causes."""
        return StateLayout(self.law.ports.n, rows_of_pieces(self._pieces),
                           offset=self.law.diagram.nstates)

    @property
    def _cause_keys(self) -> list[str]:
        return [f"{cause.block}.{number.name}" for cause in self.causes
                for number in cause.numbers]

    def _unpack(self, x: np.ndarray, params: Values) -> tuple[np.ndarray, Memory, Parameters]:
        """State of the loop, memory of the causes, and parameters beyond those of the loop."""
        p: dict[str, np.ndarray | dict[str, np.ndarray]] = {
            cause.block: {number.name: params[f"{cause.block}.{number.name}"]
                          for number in cause.numbers} for cause in self.causes}
        p["damping"] = params["damping"] - self.law.damping
        p["load"] = params["load"]
        return x[:self.law.diagram.nstates], self._layout.unpack(x), p

    def _with_sensor(self, memory: Memory, p: Parameters) -> LoopStep:
        """Steps of the loop with what the causes add to the measured position."""
        loop = self._loop
        if not any(piece.port == "sensor" for _, piece in self._pieces):
            return loop

        def function(t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            q, _ = loop.measured(t, x, u)
            read, _ = measured_position(self._at_rest(q, t), memory, self._pieces, p)
            return loop.function(t, x, loop.with_input(u, SENSOR, read - q))

        return dataclasses.replace(loop, function=function)

    def _outputs(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        x, memory, p = self._unpack(x, params)
        return np.concatenate(self._with_sensor(memory, p).measured(t, x, u))

    def _step(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        """State one step later: that of the loop alone, and what the torque of the causes adds."""
        x, memory, p = self._unpack(x, params)
        loop = self._with_sensor(memory, p)
        free = loop.free(t, x, u)
        per_torque = loop.pushed(t, x, u, free)
        rate, free_rate = loop.rate(t, x, u), loop.rate(t, free, u)
        answers = [loop.rate(t, free + change, u) - free_rate for change in per_torque]
        mass = loop.step * np.linalg.inv(np.stack(answers, axis=1))
        middle = self._middle(loop, t, x, free, u, (rate + free_rate) / 2)
        delivered, of_drive = delivered_torque(middle, memory, self._pieces, p)
        opposing, of_load = opposing_torque(middle, memory, self._pieces, p)
        limits, of_friction = dry_friction(middle, memory, self._pieces, p)
        torque = self._torque(rate, free_rate, mass, params, delivered - middle.u - opposing,
                              limits)
        after = {**of_drive, **of_friction, **of_load}
        parts = [free + sum(torque[k] * change for k, change in enumerate(per_torque))]
        for name, piece in self._pieces:
            parts += after[name] if piece.states else []
        return np.concatenate(parts)

    def _middle(self, loop: LoopStep, t: float, x: np.ndarray, free: np.ndarray, u: np.ndarray,
                rate: np.ndarray) -> State:
        """Motion in the middle of a step; a loop in discrete time holds its command."""
        (q, command), (q_end, command_end) = loop.measured(t, x, u), loop.measured(t, free, u)
        held = command if loop.discrete else (command + command_end) / 2
        return State((q + q_end) / 2, rate, held, t + loop.step / 2, loop.step, self.law.links,
                     np.ones(self.law.ports.n))

    def _at_rest(self, q: np.ndarray, t: float) -> State:
        """Joints at rest at a position, as a sensor may read them."""
        rest = np.zeros(self.law.ports.n)
        return State(q, rest, rest, t, self.law.period, self.law.links, rest + 1.0)

    def _torque(self, rate: np.ndarray, free_rate: np.ndarray, mass: np.ndarray, params: Values,
                push: np.ndarray, limits: tuple[np.ndarray, ...] | None) -> np.ndarray:
        """Torque over a step that moves the joints as the causes require [N m].

        `mass` is the inertia at the torque port, from the change of the velocities by one N m.
        """
        n, h = self.law.ports.n, self._loop.step
        added = params["inertia"] - self.law.inertia
        own = np.stack([mass[k, k] + added[k] for k in range(n)])
        cross = mass if n > 1 else None
        ddq = acceleration(mass @ (free_rate - rate) / h + push, own, cross)
        end_rate = velocity_after_friction(rate + h * ddq, own, cross, limits, h)
        return mass @ (end_rate - free_rate) / h

    def run(self, log: Log, values: Values, dithered: bool = True,
            ) -> tuple[np.ndarray, np.ndarray]:
        """Positions and commands of the loop, shape (N, n) each."""
        params = self._parameters(values)
        response = self.program.run(**self._experiment(log), params=params,
                                    initial_state=self._initial_state(log, params))
        outputs, n = np.asarray(response.outputs)[:, :len(log)], self.law.ports.n
        return outputs[:n].T.copy(), outputs[n:].T.copy()

    def positions(self, log: Log, sets: Sequence[Values], dithered: bool = True) -> np.ndarray:
        """Positions for many sets of parameters, shape (sets, n, N)."""
        chosen = [self._parameters(values) for values in sets]
        params = {key: np.stack([values[key] for values in chosen]) for key in chosen[0]}
        runs = self.program.batch(
            **self._experiment(log), params=params, threads=1,
            initial_state=np.stack([self._initial_state(log, values) for values in chosen]),
            log=self.program.outputs[:self.law.ports.n])
        return runs.outputs[:, :, :len(log)]

    def means(self, views: Sequence[Log], sets: Sequence[Values], width: int) -> list[np.ndarray]:
        """Positions for many sets, averaged over `width` neighbouring samples.

        A run in the user's loop has one view.
        """
        log, = views
        runs = self.positions(log, sets)
        rows = runs.shape[-1] // width
        return [runs[..., :rows * width].reshape(*runs.shape[:2], rows, width).mean(axis=-1)]

    def _parameters(self, values: Values) -> dict[str, np.ndarray]:
        """Parameters of the causes and the joints; those of the loop stay as they are."""
        return {key: values[key] for key in (*MODEL, *self._cause_keys)}

    def _experiment(self, log: Log) -> dict[str, Any]:
        """Duration and inputs of a log, as arguments of a run."""
        law = self.law
        inputs = {REFERENCE: np.repeat(log.q_d, law.substeps, axis=0), law.ports.torque: 0.0}
        if law.ports.has_pe:
            inputs[EXCITATION] = np.repeat(log.pe, law.substeps, axis=0)
        idle = (*law.ports.other, *((SENSOR,) if law.ports.has_sensor else ()))
        inputs.update({name: 0.0 for name in idle})
        return {"duration": len(log) * law.period, "inputs": inputs, "every": law.substeps}

    def _initial_state(self, log: Log, params: Mapping[str, np.ndarray]) -> np.ndarray:
        """State at rest where the sensor reads the first position of a log."""
        state = np.zeros(self._layout.size)
        _, memory, p = self._unpack(state, params)
        position = log.start
        for _ in range(_SENSOR_STEPS):
            read, _ = measured_position(self._at_rest(position, 0.0), memory, self._pieces, p)
            position = position + log.start - read
        state[:self.law.diagram.nstates] = self.law.at_rest(position)
        return state

    def check(self, log: Log) -> None:
        """Refuse a loop that diverges on a log, or that cannot become machine code.

        Raises
        ------
        ClieError
            If a block of the loop cannot be traced; names the block and the remedy.
        DivergedError
            If the loop's own motion becomes infinite, or far larger than the robot's.

        """
        from clie_blocks.compiled import TraceError

        law = self.law
        try:
            q, _ = self.run(log, {"inertia": law.inertia, "damping": law.damping,
                                  "load": np.zeros(law.ports.n)})
        except TraceError as error:
            raise ClieError(f"{law.diagram.name}: the diagnosis runs a loop as machine code, and "
                            f"{error}") from error
        except DivergedError as error:
            raise _diverged(law, log) from error
        largest = FARTHEST_MOTION * max(np.ptp(log.q), np.ptp(log.q_d), 1e-6)
        if np.abs(q - log.start).max() > largest:
            raise _diverged(law, log)


def _diverged(law: LoopLaw, log: Log) -> DivergedError:
    return DivergedError(
        f"{law.diagram.name} diverges: driven by the reference and excitation of {log.name} its "
        f"motion grows without bound, while the robot moves by {np.ptp(log.q):.3g} rad. Check "
        "signs, units and gains of the loop, and that no root or division in it meets a zero")
