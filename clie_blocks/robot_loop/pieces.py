"""How the effects of the catalogue act in the sampled robot: their kernels as pieces of a step."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Collection, Mapping
from hashlib import sha256
from inspect import signature
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from clie_blocks.effects import blocks
from clie_blocks.effects.blocks import filled_in
from clie_blocks.effects.delay import DelayLine
from clie_blocks.effects.dry_friction import AgeingFriction, DryFriction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.two_bodies import TwoBodies
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop.dynamics import DELAY_TAPS, Piece, State

_PORTS = {"load": "load", "environment": "load", "drive": "drive", "sensor": "sensor",
          "transmission": "sensor"}  # a link that follows its motor: the encoder sees the link

Constants = tuple[tuple[str, float], ...]
"""Parameters that no one sets, with their values: known when a program is compiled."""
Filled = Mapping[str, np.ndarray]
"""Parameters by name."""
Rows = list[np.ndarray]
"""Memory of a piece, one array (n,) per state."""


@dataclasses.dataclass(frozen=True)
class Kernel:
    """A kernel of an effect that reads the signals of an instant.

    Parameters
    ----------
    function : callable
        Pure function of its memory, its signals and its parameters.
    inputs : tuple of str
        Signals that it reads: ``'q'``, ``'dq'``, ``'u'``, ``'t'``.
    constants : tuple of (str, float)
        Parameters that are not set.

    """

    function: Callable[..., Any]
    inputs: tuple[str, ...]
    constants: Constants = ()

    @property
    def identity(self) -> str:
        """What it computes, in words that are the same in every process."""
        return (f"{type(self).__name__} {_identity_of(self.function)} {self.inputs} "
                f"{self.constants}")

    def at(self, s: State, p: Filled, *memory: np.ndarray, **more: float) -> Any:
        """Value at an instant; of `more` it takes what it names."""
        signals = (getattr(s, name) for name in self.inputs)
        return self.with_parameters({"gear_ratio": s.ratio, **p}, **more)(*memory, *signals)

    def with_parameters(self, p: Filled, **more: float) -> Callable[..., Any]:
        """Return the function with the parameters that it names filled in."""
        values: dict[str, Any] = dict(self.constants)
        return filled_in(self.function, {**values, **p, **more})


@dataclasses.dataclass(frozen=True)
class Limits(Kernel):
    """Largest torque of a dry friction, as a piece at the port ``friction``."""

    def __call__(self, s: State, z: Rows, p: Filled,
                 ) -> tuple[tuple[np.ndarray, np.ndarray], Rows]:
        """Limits against forward and against backward motion [N m], and no memory."""
        return self.at(s, p), z


@dataclasses.dataclass(frozen=True)
class Static(Kernel):
    """A kernel without memory: a torque that opposes, a torque delivered, a position measured."""

    def __call__(self, s: State, z: Rows, p: Filled) -> tuple[np.ndarray, Rows]:
        """Its first output, and no memory."""
        return _first(self.at(s, p)), z


@dataclasses.dataclass(frozen=True)
class Dynamic(Kernel):
    """A kernel with a state, whose output holds for a period.

    Parameters
    ----------
    function, inputs, constants
        As in `Kernel`; of a load, at the state of the middle of the period.
    step : callable
        State after a time `period`, from the state and the signals.
    size : int
        States per joint.
    at_middle : bool
        The output is that of the state in the middle of the period, not of the first one.

    """

    step: Callable[..., Any] = np.positive
    size: int = 1
    at_middle: bool = False

    @property
    def identity(self) -> str:
        """As of a `Kernel`, with its step."""
        return f"{super().identity} {_identity_of(self.step)} {self.size} {self.at_middle}"

    def __call__(self, s: State, z: Rows, p: Filled) -> tuple[np.ndarray, Rows]:
        """Its first output, and the memory a period later."""
        advance = Kernel(self.step, self.inputs, self.constants)
        first = z[0] if self.size == 1 else np.stack(z)
        state = advance.at(s, p, first, period=s.h / 2) if self.at_middle else first
        after = advance.at(s, p, first, period=s.h)
        return (_first(self.at(s, p, state, period=s.h)),
                [after] if self.size == 1 else list(after))


@dataclasses.dataclass(frozen=True)
class AgeingLimits(Kernel):
    """Largest torque of a dry friction with a state, as a piece at the port ``friction``.

    Parameters
    ----------
    function, inputs, constants
        As in `Kernel`.
    step : callable
        State after a time `period`, from the state and the signals.

    """

    step: Callable[..., Any] = np.positive

    def __call__(self, s: State, z: Rows, p: Filled,
                 ) -> tuple[tuple[np.ndarray, np.ndarray], Rows]:
        """Limits at the middle of the period [N m], and the state after it."""
        advance = Kernel(self.step, self.inputs, self.constants)
        middle = advance.at(s, p, z[0], period=s.h / 2)
        return self.at(s, p, middle), [advance.at(s, p, z[0], period=s.h)]


@dataclasses.dataclass(frozen=True)
class Gear(Kernel):
    """The spring between motor and link, as a piece at the port ``transmission``.

    Parameters
    ----------
    function, inputs, constants
        As in `Kernel`; it reads the twist and its rate, and the state between them.
    active : callable
        Joints that have two bodies, from the parameters.
    rate : callable or None
        Rate of the spring's state, from the state and the rate of the twist.

    """

    active: Callable[..., Any] = np.positive
    rate: Callable[..., Any] | None = None

    @property
    def identity(self) -> str:
        """As of a `Kernel`, with its state and where it acts."""
        rate = _identity_of(self.rate) if self.rate else ""
        return f"{super().identity} {_identity_of(self.active)} {rate}"

    def __call__(self, twist: np.ndarray, speed: np.ndarray, z: Rows, h: float, p: Filled,
                 link: np.ndarray, motor: np.ndarray) -> tuple[np.ndarray, Rows]:
        """Torque from motor to link [N m], and its state a step later, by the midpoint rule."""
        torque = self.with_parameters(p)
        if self.rate is None:
            return torque(twist, speed), z
        rate = Kernel(self.rate, (), self.constants).with_parameters(p)
        middle = z[0] + h / 2 * rate(z[0], speed)
        return torque(twist, speed, middle), [z[0] + h * rate(middle, speed)]

    def split(self, robot: Mapping[str, np.ndarray], p: Filled,
              ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Joints with two bodies, inertia of the link, and damping behind the gear."""
        values = {**dict(self.constants), **p}
        loose = 1.0 * Kernel(self.active, (), self.constants).with_parameters(p)()
        motor = loose * values["motor_inertia"] + (1.0 - loose) * robot["inertia"] / 2
        return loose, robot["inertia"] - motor, robot["damping"] - values["motor_damping"]


@dataclasses.dataclass(frozen=True)
class Late(Kernel):
    """A signal some time ago: the mean of its delayed staircase over a period.

    That is linear between two samples of a line of past values.

    Parameters
    ----------
    function, inputs, constants
        As in `Kernel`.
    longest : str
        Parameter that bounds the delay.

    """

    longest: str = "delay"

    def __call__(self, s: State, z: Rows, p: Filled) -> tuple[np.ndarray, Rows]:
        """The late signal, and the line one sample later."""
        line, samples = [getattr(s, self.inputs[0]), *z], self.with_parameters(p)(s.t) / s.h
        late = 0.0 * line[0]
        for k, past in enumerate(line):
            late = late + np.maximum(1.0 - np.abs(samples - k), 0.0) * past
        return late, line[:-1]


def pieces_of(effect: Effect, free: Collection[str],
              held: Mapping[str, float] = MappingProxyType({})) -> tuple[Piece, ...]:
    """Return what an effect adds to the sampled robot.

    Parameters
    ----------
    effect : Effect
        Of the catalogue, or one that is registered.
    free : collection of str
        Parameters that a run sets.
    held : dict of str to float
        Values of others; what is in neither keeps its neutral or typical value.

    Raises
    ------
    DiagramError
        If the sampled robot has no form of such a block.

    """
    constants = tuple((p.name, float(held.get(p.name, p.default))) for p in effect.parameters
                      if p.name not in free and p.of != "robot")
    if effect.port not in _PORTS:
        raise DiagramError(f"{effect.name}: it enters at the {effect.port}, and the sampled robot "
                           f"takes effects at {', '.join(_PORTS)}")
    return _pieces(effect.sampled or effect.build, effect, constants)


@functools.singledispatch
def _pieces(build: Any, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    raise DiagramError(f"{effect.name}: a block of {type(build).__name__} has no form for the "
                       "sampled robot; build it as Static, Dynamic or dry_friction")


@_pieces.register
def _of_static(build: blocks.Static, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    return (Piece(_PORTS[effect.port], Static(build.kernel, build.inputs, constants),
                  of_link=effect.port == "transmission"),)


@_pieces.register
def _of_dry_friction(build: DryFriction, effect: Effect, constants: Constants,
                     ) -> tuple[Piece, ...]:
    kernels: list[tuple[str, Limits | Static]] = [
        ("friction", Limits(build.limits, build.inputs, constants))]
    if build.rest is not None:
        kernels.append(("load", Static(build.rest, build.inputs, constants)))
    return tuple(Piece(port, kernel) for port, kernel in kernels if not _is_idle(kernel, effect))


@_pieces.register
def _of_ageing_friction(build: AgeingFriction, effect: Effect, constants: Constants,
                        ) -> tuple[Piece, ...]:
    limits = AgeingLimits(build.limits, build.inputs, constants, build.step)
    return (Piece("friction", limits, states=1),)


@_pieces.register
def _of_dynamic(build: blocks.Dynamic, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    if effect.sampled is None:
        raise DiagramError(f"{effect.name}: its state moves in continuous time; give it a form "
                           "sampled=Dynamic(step, torque, ...) whose step takes the `period`")
    port = _PORTS[effect.port]
    return (Piece(port, Dynamic(build.kernel, build.inputs, constants, build.rate, build.size,
                                at_middle=port == "load"), states=build.size,
                  of_link=effect.port == "transmission"),)


@_pieces.register
def _of_two_bodies(build: TwoBodies, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    gear = Gear(build.kernel, ("twist", "dtwist"), constants, build.active, build.memory)
    return (Piece("transmission", gear, states=int(build.memory is not None), split=gear.split),)


@_pieces.register
def _of_delay(build: DelayLine, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    return (Piece(_PORTS[effect.port], Late(build.delay, build.ports, constants, build.longest),
                  states=DELAY_TAPS),)


def with_delay_line(piece: Piece, samples: int) -> Piece:
    """Return a piece whose delay line, if it has one, recalls so many samples.

    What a longer delay asks for is zero.
    """
    return dataclasses.replace(piece, states=samples) if isinstance(piece.act, Late) else piece


def delay_samples(piece: Piece, values: Mapping[str, np.ndarray], period: float) -> int:
    """Return how many samples a piece recalls with some parameters; 0 if it delays nothing."""
    if not isinstance(piece.act, Late):
        return 0
    return math.ceil(float(np.max(values[piece.act.longest])) / period - 1e-9)


def _is_idle(kernel: Kernel, effect: Effect) -> bool:
    """Whether a part of an effect does nothing, since all its amplitudes keep zero."""
    constants, named = dict(kernel.constants), signature(kernel.function).parameters
    return all(constants.get(p.name) == p.neutral for p in effect.parameters
               if p.neutral is not None and p.name in named)


def _identity_of(function: Callable[..., Any]) -> str:
    """Name of a function; of one outside the package with the contents of its file, too."""
    named = f"{function.__module__}.{function.__qualname__}"
    if function.__module__.startswith("clie_blocks."):
        return named
    code = getattr(function, "__code__", None)
    file = Path(code.co_filename) if code else Path()
    return f"{named} {sha256(file.read_bytes()).hexdigest()}" if file.is_file() else named


def _first(outputs: Any) -> np.ndarray:
    return outputs[0] if isinstance(outputs, tuple) else outputs
