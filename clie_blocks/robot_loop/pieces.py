"""How the effects of the catalogue act in the sampled robot: their kernels as pieces of a step."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Collection, Mapping
from inspect import signature
from types import MappingProxyType
from typing import Any

import numpy as np

from clie_blocks.effects.blocks import Dynamic, Static, filled_in
from clie_blocks.effects.dry_friction import DryFriction
from clie_blocks.effects.effect import Effect
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop.dynamics import Piece, State

Constants = tuple[tuple[str, float], ...]
"""Parameters that no one sets, with their values: known when a program is compiled."""
Filled = Mapping[str, np.ndarray]
"""Parameters by name."""


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
        named = f"{self.function.__module__}.{self.function.__qualname__}"
        return f"{type(self).__name__} {named} {self.inputs} {self.constants}"

    def at(self, s: State, p: Filled, *memory: np.ndarray, **more: float) -> Any:
        """Value at an instant; of `more` it takes what it names."""
        filled = filled_in(self.function, {**dict(self.constants), **p, **more})
        return filled(*memory, *(getattr(s, name) for name in self.inputs))


@dataclasses.dataclass(frozen=True)
class Limits(Kernel):
    """Largest torque of a dry friction, as a piece at the port ``friction``."""

    def __call__(self, s: State, p: Filled) -> tuple[np.ndarray, np.ndarray]:
        """Limits against forward and against backward motion [N m]."""
        return self.at(s, p)


@dataclasses.dataclass(frozen=True)
class Torque(Kernel):
    """Torque that opposes, as a piece at the port ``load``."""

    def __call__(self, s: State, z: list[np.ndarray], p: Filled,
                 ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Torque [N m], and no memory."""
        return self.at(s, p), z


@dataclasses.dataclass(frozen=True)
class TorqueWithMemory(Kernel):
    """Torque with a state, as a piece at the port ``load``: that of the middle of a period.

    Parameters
    ----------
    function, inputs, constants
        As in `Kernel`.
    step : callable
        State after a time `period`, from the state and the signals.
    size : int
        States per joint.

    """

    step: Callable[..., Any] = np.positive
    size: int = 1

    @property
    def identity(self) -> str:
        """As of a `Kernel`, with its step."""
        return f"{super().identity} {self.step.__module__}.{self.step.__qualname__} {self.size}"

    def __call__(self, s: State, z: list[np.ndarray], p: Filled,
                 ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Torque [N m], and the memory a period later."""
        advance = Kernel(self.step, self.inputs, self.constants)
        state = z[0] if self.size == 1 else np.stack(z)
        torque = self.at(s, p, advance.at(s, p, state, period=s.h / 2))
        after = advance.at(s, p, state, period=s.h)
        return torque, [after] if self.size == 1 else list(after)


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
                      if p.name not in free)
    if effect.port not in ("load", "environment"):
        raise DiagramError(f"{effect.name}: the sampled robot takes effects at its load so far, "
                           f"and this one enters at the {effect.port}")
    return _pieces(effect.build, effect, constants)


@functools.singledispatch
def _pieces(build: Any, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    raise DiagramError(f"{effect.name}: a block of {type(build).__name__} has no form for the "
                       "sampled robot; build it as Static, Dynamic or dry_friction")


@_pieces.register
def _of_static(build: Static, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    return (Piece("load", Torque(build.kernel, build.inputs, constants)),)


@_pieces.register
def _of_dry_friction(build: DryFriction, effect: Effect, constants: Constants,
                     ) -> tuple[Piece, ...]:
    pieces = [Piece("friction", Limits(build.limits, build.inputs, constants))]
    if build.rest is not None:
        pieces.append(Piece("load", Torque(build.rest, build.inputs, constants)))
    return tuple(piece for piece in pieces if not _is_idle(piece.act, effect))


def _is_idle(kernel: Kernel, effect: Effect) -> bool:
    """Whether a part of an effect does nothing, since all its amplitudes keep zero."""
    constants, named = dict(kernel.constants), signature(kernel.function).parameters
    return all(constants.get(p.name) == p.neutral for p in effect.parameters
               if p.neutral is not None and p.name in named)


@_pieces.register
def _of_dynamic(build: Dynamic, effect: Effect, constants: Constants) -> tuple[Piece, ...]:
    sampled = effect.sampled
    if not isinstance(sampled, Dynamic):
        raise DiagramError(f"{effect.name}: its state moves in continuous time; give it a form "
                           "sampled=Dynamic(step, torque, ...) whose step takes the `period`")
    return (Piece("load", TorqueWithMemory(sampled.kernel, sampled.inputs, constants,
                                           sampled.rate, sampled.size), states=sampled.size),)
