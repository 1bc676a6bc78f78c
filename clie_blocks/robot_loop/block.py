"""The sampled loop of a robot with the effects of a hypothesis, as one block in discrete time.

One update is one period of the controller.  The parameters of the robot are arguments, so that the
program of a block depends on the structure of a robot only.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.labels import signals
from clie_blocks.robot_loop.dynamics import (
    Memory,
    NamedPieces,
    Parameters,
    State,
    Values,
    delivered_torque,
    formed_velocity,
    law_command,
    limited,
    measured_position,
)
from clie_blocks.robot_loop.links import Layout, Links
from clie_blocks.robot_loop.motion import move_apart, move_as_one
from clie_blocks.robot_loop.sampled_law import PARAMETERS, TORQUE, VELOCITY, SampledLaw
from clie_blocks.robot_loop.state_layout import StateLayout, rows_of_pieces

if TYPE_CHECKING:
    from control import NonlinearIOSystem

_INVERSIONS = 8  # steps in which the position behind an uneven gear is found
PER_JOINT = ("inertia", "damping", "load", "kp", "kd", "saturation", "ratio")


@dataclasses.dataclass(frozen=True)
class Structure:
    """What of a robot decides the program: everything but its parameters.

    An encoder on the motor sees the motor where motor and link move apart.  Of two encoders, on
    motor and link, the other one is that on which the law does not act.  Without a law of its own
    a robot runs under PD (11), whose gains and filters are parameters.  Where the drives are
    `supplied`, their voltage over its nominal value is an input.
    """

    n: int
    period: float
    links: Layout
    clipped: bool
    encoder_on_motor: bool = False
    two_encoders: bool = False
    law: SampledLaw | None = None
    supplied: bool = False
    beside_record: bool = False


@dataclasses.dataclass(frozen=True, eq=False)
class LoopBlock:
    """The sampled loop as a block with the inputs q_d, pe, noise and the outputs q, u, sum.

    A further input ``supply`` scales what the drives make of a command, as the voltage of a motor
    without current control does.  With two encoders ``other`` and its sum, ``sum_other``, follow:
    the position that the other encoder sees.

    A law of its own may read a velocity and a torque that the drive measures.  The velocity is
    that of the filter ``b, a`` of the position as it is read; the torque is the one that the drive
    gave in the sample before.  What the drive's measurements are beyond that are the inputs
    ``noise_dq`` and ``noise_tau``.  Where the structure is `beside_record`, the torque that the
    same drive gives for the commands of a record, the input ``recorded``, is taken off: with the
    recorded torque as ``noise_tau``, the law reads that one where the commands are the recorded.
    A piece of the drive may read that input, too.

    Parameters
    ----------
    shape : Structure
        Of the robot.
    pieces : sequence of (str, Piece)
        What the effects add, with the name of each effect's block.
    parameter_names : mapping
        Names of the parameters of each effect, by block.

    """

    shape: Structure
    pieces: NamedPieces
    parameter_names: Mapping[str, tuple[str, ...]]

    @functools.cached_property
    def layout(self) -> StateLayout:
        """Memory of the law, motion, sum of the measured positions, memory of the pieces."""
        law = self.shape.law
        of_law = {VELOCITY: {"rate": 2}, TORQUE: {"given": 1}}
        rows = {} if law else {"law": 2}
        for port in law.reads if law else ():
            rows |= of_law[port]
        if self.shape.beside_record:
            rows |= {_of_record(name): count for name, count in
                     rows_of_pieces(self._of_drive).items()}
        rows |= {"q": 1, "dq": 1, "sum": 1}
        if self.moves_apart:
            rows.update(q_motor=1, dq_motor=1)
        if self.shape.two_encoders:
            rows.update(sum_other=1)
        return StateLayout(self.shape.n, {**rows, **rows_of_pieces(self.pieces)},
                           offset=law.states if law else 0)

    @property
    def moves_apart(self) -> bool:
        """Whether motor and link move apart."""
        return any(piece.port == "transmission" for _, piece in self.pieces)

    @functools.cached_property
    def system(self) -> NonlinearIOSystem:
        """The block as a python-control system, with harmless parameters."""
        return self.block(self._sample_parameters(), "robot")

    def block(self, params: Values, name: str) -> NonlinearIOSystem:
        """Return the block as a python-control system with parameters of its own."""
        import control as ct

        step, measure, n = self._step, self._outputs, self.shape.n

        def update(t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
            return step(t, x, u, params)

        def output(t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
            return measure(t, x, u, params)

        return ct.nlsys(update, output, name=name, params=dict(params),
                        states=[*self._law_states, *self.layout.labels], dt=self.shape.period,
                        inputs=signals(*self.inputs, n=n),
                        outputs=signals(*self.outputs, n=n))

    @property
    def _law_states(self) -> list[str]:
        """Names of the states of a law of its own, which stand first."""
        return [f"law_{k}" for k in range(self.layout.offset)]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        reads = self.shape.law.reads if self.shape.law else ()
        return ("q_d", "pe", "noise", *(f"noise_{port}" for port in reads),
                *(("recorded",) if self.reads_record else ()),
                *(("supply",) if self.shape.supplied else ()))

    @property
    def reads_record(self) -> bool:
        """Whether the recorded command is an input."""
        return self.shape.beside_record or any(piece.reads_record for _, piece in self.pieces)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return ("q", "u", "sum", *(("other", "sum_other") if self.shape.two_encoders else ()))

    def _sample_parameters(self) -> dict[str, np.ndarray]:
        """Parameters of the right shapes, harmless for a check of the compiled program."""
        n = self.shape.n
        values = {key: np.ones(n) for key in (*PER_JOINT, "start", "first")}
        values.update({f"links.{name}": value for name, value in
                       self.shape.links.sample_parameters().items()})
        values.update({"b": np.ones((3, n)), "a": np.ones((3, n))})
        values.update({f"{block}.{name}": np.ones(n)
                       for block, names in self.parameter_names.items() for name in names})
        values["inertia"] = 3.0 + values["inertia"]
        if self.shape.law and self.shape.law.values:
            values[PARAMETERS] = np.array(self.shape.law.values)
        return values

    def initial_state(self, start: np.ndarray, speed: float | np.ndarray, values: Values,
                      law_state: np.ndarray | None = None) -> np.ndarray:
        """State with the joints at a position [rad]: at rest, or moving at a speed [rad/s].

        A law of its own begins with a state that is given.
        """
        where, state = self.layout.slices, np.zeros(self.layout.size)
        if self.shape.law and law_state is not None:
            state[:self.layout.offset] = law_state
        for name in ("q", "q_motor") if self.moves_apart else ("q",):
            state[where[name]] = start
        for name, piece in self.pieces:
            if piece.port == "sensor" and piece.states:
                state[where[name]] = np.tile(start, piece.states)
        if np.any(speed):
            for name in ("dq", "dq_motor") if self.moves_apart else ("dq",):
                state[where[name]] = speed
            for name in where.keys() & {"law", "rate"}:
                state[where[name]] = ramp_memory(
                    speed * np.ones(self.shape.n), values["b"], values["a"], self.shape.period)
        return state

    def joint_at(self, measured: np.ndarray, values: Values) -> np.ndarray:
        """Position of the joints at which the law's encoder reads one behind an uneven gear.

        What an encoder itself adds is not undone: a log states where its robot stands.
        """
        between = tuple((name, piece) for name, piece in self._seen_by_law if piece.of_link)
        if not between:
            return measured
        given = {**values, "start": measured, "first": np.zeros(self.shape.n)}
        memory, p, links = self._unpack(np.zeros(self.layout.size), given)
        now = dataclasses.replace(self._now(0.0, memory, p, links), q=measured)
        for _ in range(_INVERSIONS):
            seen, _ = measured_position(now, memory, between, p)
            now = dataclasses.replace(now, q=now.q + measured - seen)
        return now.q

    @functools.cached_property
    def _of_link(self) -> NamedPieces:
        """Pieces between motor and link, which an encoder of the link sees."""
        return tuple((name, piece) for name, piece in self.pieces if piece.of_link)

    def _unpack(self, x: np.ndarray, params: Values) -> tuple[Memory, Parameters, Links]:
        """Memory of every block, parameters of robot and effects, and the links."""
        p: dict[str, np.ndarray | dict[str, np.ndarray]] = {
            key: params[key] for key in (*PER_JOINT, "start", "first", "b", "a")}
        p[PARAMETERS] = params.get(PARAMETERS, np.zeros(0))
        p.update({block: {name: params[f"{block}.{name}"] for name in names}
                  for block, names in self.parameter_names.items()})
        memory = self.layout.unpack(x)
        if self.shape.law:
            memory["law"] = [x[:self.layout.offset]]
        return memory, p, self.shape.links.links(params)

    def _outputs(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        memory, p, links = self._unpack(x, params)
        joint = self._now(t, memory, p, links)
        now = self._at_encoder(joint, memory)
        q, _ = measured_position(now, memory, self._seen_by_law, p)
        command, _ = self._command(now, q, self._given(u), memory, p)
        if not self.shape.two_encoders:
            return np.concatenate((q, command, memory["sum"][0]))
        other, _ = self._other_position(joint, memory, p)
        return np.concatenate((q, command, memory["sum"][0], other, memory["sum_other"][0]))

    @functools.cached_property
    def _seen_by_law(self) -> NamedPieces:
        """Pieces without those that only the other encoder sees."""
        if not (self.shape.two_encoders and self.shape.encoder_on_motor):
            return self.pieces
        return tuple((name, piece) for name, piece in self.pieces if not piece.of_link)

    def _other_position(self, joint: State, memory: Memory, p: Parameters,
                        ) -> tuple[np.ndarray, Memory]:
        """Position that the other encoder sees, and the memory of its pieces a sample later."""
        if self.shape.encoder_on_motor:
            return measured_position(joint, memory, self._of_link, p)
        return memory["q_motor" if self.moves_apart else "q"][0], {}

    def _now(self, t: float, memory: Memory, p: Parameters, links: Links) -> State:
        """Motion at a sample, before there is a command."""
        (q,), (dq,) = memory["q"], memory["dq"]
        return State(q, dq, np.zeros(self.shape.n), t, self.shape.period, links, p["ratio"])

    def _at_encoder(self, now: State, memory: Memory) -> State:
        """Motion of the shaft that carries the encoder."""
        if not (self.shape.encoder_on_motor and self.moves_apart):
            return now
        (q_motor,), (dq_motor,) = memory["q_motor"], memory["dq_motor"]
        return dataclasses.replace(now, q=q_motor, dq=dq_motor)

    def _given(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """Inputs by name, shape (n,) each."""
        n = self.shape.n
        return {name: u[k * n:(k + 1) * n] for k, name in enumerate(self.inputs)}

    def _command(self, now: State, q: np.ndarray, given: Values, memory: Memory, p: Parameters,
                 ) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """Command of the law for a measured position, and its memory one sample later."""
        law, q_d, pe, read = self.shape.law, given["q_d"], given["pe"], q + given["noise"]
        if law is None:
            return law_command(read, q_d, pe, memory["law"], self._first_read(now, p),
                               self.shape.clipped, p)
        of_drive: list[np.ndarray] = []
        of_filter: tuple[np.ndarray, ...] = ()
        if VELOCITY in law.reads:
            rate, of_filter = formed_velocity(
                read - self._first_read(now, p), memory["rate"], p["b"], p["a"])
            of_drive.append(rate + given["noise_dq"])
        if TORQUE in law.reads:
            of_drive.append(memory["given"][0] / np.array(law.scale) + given["noise_tau"])
        after, command = law.step(now.t, memory["law"][0], q_d, read, pe, p[PARAMETERS], *of_drive)
        return limited(command, self.shape.clipped, p), (after, *of_filter)

    def _read_next(self, now: State, torque: np.ndarray, given: Values, memory: Memory,
                   p: Parameters) -> list[np.ndarray]:
        """What the law reads of the drive's torque a sample later, with the memory of that."""
        if "given" not in memory:
            return []
        if not self.shape.beside_record:
            return [torque]
        own = {name: memory[_of_record(name)] for name, _ in self._of_drive}
        of_record, after = delivered_torque(
            dataclasses.replace(now, u=given["recorded"]), own, self._of_drive, p)
        kept = [after[name] for name, piece in self._of_drive if piece.states]
        return [torque - of_record, *itertools.chain.from_iterable(kept)]

    @functools.cached_property
    def _of_drive(self) -> NamedPieces:
        """Pieces of the drive."""
        return tuple((name, piece) for name, piece in self.pieces if piece.port == "drive")

    def _first_read(self, now: State, p: Parameters) -> np.ndarray:
        """Position that the law reads at the first sample, where its velocity filter rests."""
        at_rest = {name: [p["start"]] * piece.states for name, piece in self.pieces}
        start, _ = measured_position(
            dataclasses.replace(now, q=p["start"]), at_rest, self._seen_by_law, p)
        return start + p["first"]

    def _step(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        """State one period later: measure, command, hold, move."""
        memory, p, links = self._unpack(x, params)
        now = self._now(t, memory, p, links)
        seen = self._at_encoder(now, memory)
        q, of_sensor = measured_position(seen, memory, self._seen_by_law, p)
        given = self._given(u)
        command, of_law = self._command(seen, q, given, memory, p)
        supplied = command * given["supply"] if self.shape.supplied else command
        torque, of_drive = delivered_torque(
            dataclasses.replace(now, u=supplied, recorded=given.get("recorded")), memory,
            self.pieces, p)
        move = move_apart if self.moves_apart else move_as_one
        motion, of_load = move(dataclasses.replace(now, u=torque), memory, self.pieces, p)
        after = {**of_drive, **of_sensor, **of_load}
        read_next = self._read_next(now, torque, given, memory, p)
        parts = [*of_law, *read_next, *motion[:2], memory["sum"][0] + q, *motion[2:]]
        if self.shape.two_encoders:
            other, of_other = self._other_position(now, memory, p)
            parts, after = [*parts, memory["sum_other"][0] + other], {**after, **of_other}
        for name, piece in self.pieces:
            parts += after[name] if piece.states else []
        return np.concatenate(parts)


def _of_record(name: str) -> str:
    """Name of the memory of a drive's block for the commands of a record."""
    return f"{name}, recorded"


def ramp_memory(speed: np.ndarray, b: np.ndarray, a: np.ndarray, period: float) -> np.ndarray:
    """Memory of a velocity filter that has followed a ramp up to the first sample, where it is 0.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Slope of the ramp [rad/s].
    b, a : ndarray, shape (3, n)
        Coefficients of the filter, from position to velocity.
    period : float
        Sample time [s].

    Returns
    -------
    ndarray, shape (2 n,)
        What the transposed direct form adds to this sample's output, and to the next one's.

    """
    step = speed * period
    of_next = -step * (b[1] + 2 * b[2]) / (1 + a[1] + a[2])
    return np.concatenate((of_next, -b[2] * step - a[2] * of_next))
