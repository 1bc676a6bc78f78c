"""Closed-loop simulation of the robot with the effects of a hypothesis, as machine code.

The sampled loop is one block in discrete time, one update per period of the controller.  Its
program depends on the structure of a robot only, its numbers are arguments: the next robot of the
same structure runs without compilation.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.planar_chain import PlanarChain
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation import dynamics as robot
from clie_blocks.analysis.gap.simulation.batch_runs import batch_signals
from clie_blocks.analysis.gap.simulation.dynamics import (
    DELAY_TAPS,
    SUBSTEPS,
    ActingCause,
    Memory,
    Parameters,
    Piece,
    State,
)
from clie_blocks.compiled.cache.cached_program import cached_program, source_digest
from clie_blocks.errors import DivergedError
from clie_blocks.labels import signals

if TYPE_CHECKING:
    from control import NonlinearIOSystem

    from clie_blocks.compiled import Program
    from clie_blocks.compiled.cache.cached_program import CachedProgram

Values = Mapping[str, np.ndarray]  # parameters of the simulator by key
Limits = tuple[np.ndarray, ...] | None  # dry friction against forward and backward motion
Mass = tuple[np.ndarray, np.ndarray | None]  # own, and shared with the other joints

SHORT = 20  # samples of a line of delays that serves most robots
MOST_LINK = 0.97  # of a joint's inertia: some is left to the motor
PER_JOINT = ("inertia", "damping", "load", "kp", "kd", "saturation", "ratio")


@dataclasses.dataclass(frozen=True)
class Structure:
    """What of a robot decides the program, not its numbers."""

    n: int
    period: float
    known: bool
    has_gravity: bool
    has_coupling: bool
    clipped: bool


def structure(problem: Problem) -> Structure:
    """Return the structure of a problem."""
    chain, law = problem.chain, problem.law
    return Structure(problem.n, problem.period, chain.known, chain.has_gravity,
                     chain.has_coupling, bool(np.isfinite(law.saturation).all()))


def constants(problem: Problem) -> dict[str, np.ndarray]:
    """Parameters of the simulator that are stated, by key."""
    law, nominal, chain = problem.law, problem.nominal, problem.chain
    values = {"inertia": nominal.inertia, "damping": nominal.damping, "load": nominal.load,
              "kp": law.kp, "kd": law.kd, "b": law.numerator, "a": law.denominator,
              "saturation": np.minimum(law.saturation, 1e9), "ratio": problem.gear_ratio}
    values.update({f"chain.{name}": getattr(chain, name) for name in chain.numbers})
    return {key: np.array(value, float) for key, value in values.items()}


@functools.lru_cache(maxsize=512)
def simulator(shape: Structure, causes: tuple[ActingCause, ...]) -> Simulator:
    """Simulator of a structure with some causes; compiled once."""
    pieces, numbers = [], {}
    for cause in causes:
        pieces += [(cause.block, piece) for piece in cause.pieces]
        numbers[cause.block] = tuple(number.name for number in cause.numbers)
    return Simulator(shape, tuple(pieces), numbers)


@dataclasses.dataclass(frozen=True, eq=False)
class Simulator:
    """Closed loop with given pieces; `run` gives the measured positions and the commands.

    Parameters
    ----------
    shape : Structure
        Of the robot.
    pieces : tuple of (str, Piece)
        What the effects add, with the name of each effect's block.
    numbers : dict
        Names of the numbers of each effect.

    """

    shape: Structure
    pieces: tuple[tuple[str, Piece], ...]
    numbers: dict[str, tuple[str, ...]]

    @functools.cached_property
    def program(self) -> CachedProgram | Program:
        """The compiled program; an earlier process may have compiled it."""
        return cached_program(self._identity, lambda: self.block)

    @property
    def _identity(self) -> str:
        """What decides the program: sources, structure, and how the pieces act."""
        acts = [(name, piece.port, piece.states, piece.act.__module__, piece.act.__qualname__)
                for name, piece in self.pieces]
        here = source_digest("clie_blocks.compiled", "clie_blocks.analysis.gap")
        return "\n".join((here, *map(repr, (self.shape, acts, self.numbers))))

    @functools.cached_property
    def layout(self) -> dict[str, tuple[slice, int]]:
        """Slices of the state: motion, sum of what was measured, memory of law and pieces."""
        n, at, found = self.shape.n, 0, {}
        sizes = {"q": 1, "dq": 1, "law": 2, "sum": 1}
        if self.loose:
            sizes.update(q_motor=1, dq_motor=1)
        sizes.update({name: piece.states for name, piece in self.pieces if piece.states})
        for name, rows in sizes.items():
            found[name] = (slice(at, at + rows * n), rows)
            at += rows * n
        return found

    @property
    def loose(self) -> bool:
        """Whether motor and link move apart."""
        return any(piece.port == "transmission" for _, piece in self.pieces)

    @functools.cached_property
    def block(self) -> NonlinearIOSystem:
        """The loop as a python-control block; Inputs: q_d, pe, noise.  Outputs: q, u, sum."""
        import control as ct

        n = self.shape.n
        size = max(where.stop for where, _ in self.layout.values())
        step, seen = self._step, self._seen

        def update(t, x, u, params):
            return step(t, x, u, params)

        def output(t, x, u, params):
            return seen(t, x, u, params)

        return ct.nlsys(update, output, name="robot", params=self._samples(),
                        states=[f"x[{k}]" for k in range(size)], dt=self.shape.period,
                        inputs=signals("q_d", "pe", "noise", n=n),
                        outputs=signals("q", "u", "sum", n=n))

    def _samples(self) -> dict[str, np.ndarray]:
        """Parameters of the right shapes, harmless for a check of the compiled program."""
        n = self.shape.n
        values = {key: np.ones(n) for key in (*PER_JOINT, "start", "first")}
        values.update({f"chain.{name}": np.ones(n) for name in PlanarChain.numbers})
        values.update({"b": np.ones((3, n)), "a": np.ones((3, n)), "chain.g": np.array(9.81)})
        values.update({f"{name}.{key}": np.ones(n)
                       for name, keys in self.numbers.items() for key in keys})
        values["inertia"] = 3.0 + values["inertia"]
        return values

    def run(self, log: Log, values: Values, dithered: bool = True,
            ) -> tuple[np.ndarray, np.ndarray]:
        """Positions as the sensor sees them, and commands of the model, shape (N, n) each.

        Raises
        ------
        DivergedError
            If the model leaves every bound.
        """
        found, = batch_signals(self, log, [values], ("q", "u"), dithered)
        if not np.isfinite(found).all():
            raise DivergedError(f"the model leaves every bound in {log.name}: its closed loop is "
                                "unstable with these numbers")
        q, u = np.split(found[:, :len(log)], 2)
        return q.T.copy(), u.T.copy()

    def positions(self, log: Log, sets: Sequence[Values], dithered: bool = True) -> np.ndarray:
        """Measured positions for many sets of parameters, side by side.

        Parameters
        ----------
        log : Log
            As for `run`.
        sets : list of dict
            Parameters by key; a run that diverges is NaN.
        dithered : bool
            As for `run`.

        Returns
        -------
        ndarray, shape (sets, n, N)
            One row of samples per set and joint.

        """
        return batch_signals(self, log, sets, ("q",), dithered)[..., :len(log)]

    def means(self, log: Log, sets: Sequence[Values], width: int) -> np.ndarray:
        """Measured positions for many sets, averaged over neighbouring samples.

        Parameters
        ----------
        log : Log
            As for `run`.
        sets : list of dict
            As for `positions`.
        width : int
            Samples that are averaged into one.

        Returns
        -------
        ndarray, shape (sets, n, N // width)
            One row of means per set and joint: the tenth of the rows costs a quarter less.

        """
        with np.errstate(invalid="ignore"):  # a run that has left the numbers goes on as NaN
            return np.diff(batch_signals(self, log, sets, ("sum",), every=width)) / width

    def check(self, log: Log) -> None:
        """A stated loop runs beside any log; whether it diverges, its fit says."""

    def for_delays(self, longest: float) -> Simulator:
        """Return the same simulator with lines of delays that are long enough, and no longer.

        What lies further back in a line is multiplied by zero, and moving it is most of a step.

        Parameters
        ----------
        longest : float
            The longest delay [s].

        """
        return self._short if longest <= SHORT * self.shape.period else self

    @functools.cached_property
    def delays(self) -> tuple[str, ...]:
        """Names of the pieces that delay."""
        return tuple(name for name, piece in self.pieces if piece.states == DELAY_TAPS)

    @functools.cached_property
    def _short(self) -> Simulator:
        if not self.delays:
            return self
        return dataclasses.replace(self, pieces=tuple(
            (name, dataclasses.replace(piece, states=SHORT) if name in self.delays else piece)
            for name, piece in self.pieces))

    def start(self, log: Log, values: Values) -> np.ndarray:
        """State at the first sample of a log: at rest, or in its motion."""
        state = np.zeros(max(where.stop for where, _ in self.layout.values()))
        for name in ("q", "q_motor") if self.loose else ("q",):
            state[self.layout[name][0]] = log.start
        for name, piece in self.pieces:
            if piece.port == "sensor" and piece.states:
                state[self.layout[name][0]] = np.tile(log.start, piece.states)
        if np.any(log.speed):
            for name in ("dq", "dq_motor") if self.loose else ("dq",):
                state[self.layout[name][0]] = log.speed
            state[self.layout["law"][0]] = ramp_memory(
                log.speed, values["b"], values["a"], self.shape.period)
        return state

    def _unpack(self, x: np.ndarray, params: Values) -> tuple[Memory, Parameters, PlanarChain]:
        n, shape = self.shape.n, self.shape
        memory = {name: [x[where][i * n:(i + 1) * n] for i in range(rows)]
                  for name, (where, rows) in self.layout.items()}
        for name, _ in self.pieces:
            memory.setdefault(name, [])
        p = {key: params[key] for key in (*PER_JOINT, "start", "first", "b", "a")}
        p.update({name: {key: params[f"{name}.{key}"] for key in keys}
                  for name, keys in self.numbers.items()})
        chain = PlanarChain(has_gravity=shape.has_gravity, has_coupling=shape.has_coupling,
                            known=shape.known,
                            **{name: params[f"chain.{name}"] for name in PlanarChain.numbers})
        return memory, p, chain

    def _seen(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        memory, p, _ = self._unpack(x, params)
        q, _ = robot.measured_position(memory["q"][0], memory, self.pieces, p, self.shape.period)
        torque, _ = self._command(q, u, memory, p)
        return np.concatenate((q, torque, memory["sum"][0]))

    def _command(self, q: np.ndarray, u: np.ndarray, memory: Memory, p: Parameters,
                 ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        n = self.shape.n
        still = {name: [p["start"]] * piece.states for name, piece in self.pieces}
        start, _ = robot.measured_position(p["start"], still, self.pieces, p, self.shape.period)
        return robot.law_command(q + u[2 * n:], u[:n], u[n:2 * n], memory["law"],
                                 start + p["first"], self.shape.clipped, p)

    def _step(self, t: float, x: np.ndarray, u: np.ndarray, params: Values) -> np.ndarray:
        memory, p, chain = self._unpack(x, params)
        h = self.shape.period
        q, seen = robot.measured_position(memory["q"][0], memory, self.pieces, p, h)
        torque, after = self._command(q, u, memory, p)
        torque, kept = robot.delivered_torque(torque, memory, self.pieces, p, h)
        now = State(memory["q"][0], memory["dq"][0], torque, t, h, chain, p["ratio"])
        motion, remembered = (self._move_apart if self.loose else self._move)(now, memory, p)
        kept.update(seen, **remembered)
        parts = [*motion[:2], *after, memory["sum"][0] + q, *motion[2:]]
        for name, piece in self.pieces:
            parts += kept[name] if piece.states else []
        return np.concatenate(parts)

    def _move(self, now: State, memory: Memory, p: Parameters,
              ) -> tuple[tuple[np.ndarray, ...], Memory]:
        """Motion after a period by the midpoint rule.

        Position and time of the middle are known before, so both halves read them: the order is
        the same, and what depends on position alone is computed once.
        """
        h, q, dq = now.h, now.q, now.dq
        middle = dataclasses.replace(now, q=q + h / 2 * dq, t=now.t + h / 2)
        ddq, limits, _, mass = self._accelerated(middle, memory, p)
        middle_rate = robot.velocity_after_friction(dq + h / 2 * ddq, *mass, limits, h / 2)
        middle = dataclasses.replace(middle, dq=middle_rate)
        ddq, limits, after, mass = self._accelerated(middle, memory, p)
        end_rate = robot.velocity_after_friction(dq + h * ddq, *mass, limits, h)
        return (q + h / 2 * (dq + end_rate), end_rate), after

    def _accelerated(self, s: State, memory: Memory, p: Parameters,
                     ) -> tuple[np.ndarray, Limits, Memory, Mass]:
        torque, after = robot.opposing_torque(s, memory, self.pieces, p)
        own, cross, bias = robot.link_terms(s, self.pieces, p)
        own = p["inertia"] + own
        ddq = robot.acceleration(s.u - torque - bias, own, cross)
        return ddq, robot.dry_friction(s, self.pieces, p), after, (own, cross)

    def _move_apart(self, now: State, memory: Memory, p: Parameters,
                    ) -> tuple[tuple[np.ndarray, ...], Memory]:
        h = now.h / SUBSTEPS
        q, dq, (q_m,), (dq_m,) = now.q, now.dq, memory["q_motor"], memory["dq_motor"]
        (name, gap), = [(name, piece) for name, piece in self.pieces
                        if piece.port == "transmission"]
        loose = p[name]["loose"]
        link, link_damping = link_share_of_joint(now.chain, now.ratio, p, p[name]["link_share"])
        motor, behind = p["inertia"] - link, loose * p[name]["bearing_share"] * link_damping
        held = link + (1.0 - loose) * motor  # a joint without play moves as one
        after = {}
        for _ in range(SUBSTEPS):
            q, q_m = q + h / 2 * dq, q_m + h / 2 * dq_m
            of_link = dataclasses.replace(now, q=q, dq=dq)
            of_motor = dataclasses.replace(now, q=q_m, dq=dq_m)
            passed = gap.act(q_m - q, dq_m - dq, p[name], link, motor)
            own, cross, bias = robot.link_terms(of_link, self.pieces, p)
            torque, after = robot.opposing_torque(of_motor, memory, self.pieces, p)
            driven = now.u - torque
            ddq = robot.acceleration(loose * passed + (1.0 - loose) * driven - bias - behind * dq,
                                     held + own, cross)
            ddq_m = (driven - passed + behind * dq_m) / motor
            dq = dq + h * ddq
            dq_m = dq_m + h * ddq_m
            limits = robot.dry_friction(of_motor, self.pieces, p)
            if limits is not None:
                dq = robot.velocity_after_friction(dq, held + own, cross,
                                   tuple((1.0 - loose) * side for side in limits), h)
                dq_m = robot.velocity_after_friction(dq_m, motor, None, limits, h)
            q, q_m = q + h / 2 * dq, q_m + h / 2 * dq_m
            q_m, dq_m = q + loose * (q_m - q), dq + loose * (dq_m - dq)
        return (q, dq, q_m, dq_m), after


def link_share_of_joint(chain: PlanarChain, ratio: np.ndarray, p: Parameters, share: np.ndarray,
                        ) -> tuple[np.ndarray, np.ndarray]:
    """Inertia and damping of the link alone, motor side.

    The inertia is a share of the stated one, or of the whole joint where no links are stated.
    """
    stated = chain.diagonal / ratio if chain.known else p["inertia"]
    damping = chain.bearing_damping / ratio if chain.known else 0.0 * p["damping"]
    return np.minimum(share * stated, MOST_LINK * p["inertia"]), damping


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
    shown = -step * (b[1] + 2 * b[2]) / (1 + a[1] + a[2])
    return np.concatenate((shown, -b[2] * step - a[2] * shown))
