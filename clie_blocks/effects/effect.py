"""What the catalogue knows of an effect, and an effect with its parameters set."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.effects.characteristic import Curve, path_of
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.two_bodies import TwoBodies
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError, vector

if TYPE_CHECKING:
    import control as ct

FAMILIES = ("friction", "load", "transmission", "drive", "timing", "controller", "sensor",
            "environment", "parametric")
PORTS = ("controller", "drive", "load", "body", "environment", "transmission", "sensor", "log")
SIMULATORS = ("mujoco", "isaac", "gazebo", "simscape")
SYMMETRIES = ("odd", "even", "none")


class Builder(Protocol):
    """What makes the block of an effect, such as `clie_blocks.effects.blocks.Static`."""

    @property
    def kernel(self) -> Callable[..., Any]:
        """Its pure function."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Signals it gives."""

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""


@dataclass(frozen=True, repr=False)
class Effect:
    """One effect of the catalogue; call it with values to get a `Setting` for `with_effects`.

    Parameters
    ----------
    name, family : str
        Its name in diagnoses, and its family of `FAMILIES`.
    port : str
        Where it enters, one of `PORTS`; see `clie_blocks.effects.insertion`.
    build : callable
        ``build(values, n, name)`` makes the block; its `kernel` is the pure function.
    parameters : tuple of Parameter
        Its parameters, those with a neutral value first.
    equation : str
        The kernel as one line of text.
    reference : str
        Where the model comes from.
    signature : str
        What a log looks like.
    confused_with : dict
        Effect with a similar signature -> the experiment that separates the two.
    simulators : dict
        Name and parameter in each of `SIMULATORS`, or ``'none'``.
    wrong : str
        Where the model is wrong.
    passive : bool
        It never gives energy to the joint.
    symmetry : str
        ``'odd'`` or ``'even'`` under a change of sign of all its input signals, or ``'none'``.
    per_joint : bool
        Joint k acts on joint k alone.
    stiff : bool
        It has a fast or discontinuous mode; the halved-step table covers it.
    side : str
        Where a load acts when a transmission has a motor and a link: ``'motor'`` or ``'link'``.
    curve : tuple of (str, float) or None
        Input signal and its largest value, for the drawn characteristic.
    symbol : str
        What its block shows in a picture where there is no such curve, as mathtext.
    sampled : callable or None
        ``sampled(values, n, name, period)`` makes its form for a sampled controller; None for one
        that has a state in continuous time alone, or no state.

    """

    name: str
    family: str
    port: str
    build: Builder
    parameters: tuple[Parameter, ...]
    equation: str
    reference: str
    signature: str
    confused_with: Mapping[str, str]
    simulators: Mapping[str, str]
    wrong: str
    passive: bool = False
    symmetry: str = "none"
    per_joint: bool = True
    stiff: bool = False
    side: str = "motor"
    curve: tuple[str, float] | None = None
    symbol: str = ""
    sampled: Callable | None = None

    def __repr__(self) -> str:
        named = ", ".join(p.name for p in self.parameters)
        return f"<effect {self.name}({named}) at the {self.port}>"

    def __call__(self, *, joints: int | Sequence[int] | None = None, name: str | None = None,
                 **values: ArrayLike) -> Setting:
        """Set the parameters: ``coulomb(level=0.3, joints=[1])``.

        Parameters
        ----------
        joints : int or list of int, optional
            Joints (from 0) that have the effect; on the others it is neutral.  All by default.
        name : str, optional
            Name of the block, by default that of the effect.
        **values : array_like, shape () or (n,)
            Parameters by name; at least one with a neutral value, since without any the effect
            does nothing.

        Returns
        -------
        Setting
            The effect with its parameters set.

        Raises
        ------
        DiagramError
            For an unknown name, a value out of bounds, or no amplitude at all.

        """
        known = {p.name: p for p in self.parameters}
        for key, value in values.items():
            if key not in known:
                raise DiagramError(f"{self.name}: no parameter {key!r}; {nearest(key, known)}")
            _check_bounds(self.name, known[key], value)
        amplitudes = [p.name for p in self.parameters if p.neutral is not None]
        if not set(amplitudes) & set(values):
            raise DiagramError(f"{self.name}: without a value for {' or '.join(amplitudes)} it "
                               f"changes nothing; typical: {self.typical_values(amplitudes)}")
        if joints is not None and not any(known[key].per_joint for key in amplitudes):
            raise DiagramError(f"{self.name}: it acts on the robot as a whole; leave joints= out")
        return Setting(self, values, _joint_list(joints), name or self.name)

    def typical(self, *, joints: int | Sequence[int] | None = None, name: str | None = None,
                **values: ArrayLike) -> Setting:
        """Set every parameter to its typical value, except those given."""
        chosen: dict[str, Any] = {**self.typical_values(), **values}
        return self(joints=joints, name=name, **chosen)

    def neutral(self, *, name: str | None = None) -> Setting:
        """Set every amplitude to the value that removes the effect bit for bit."""
        amplitudes: dict[str, Any] = {p.name: p.neutral for p in self.parameters
                                      if p.neutral is not None}
        return self(name=name, **amplitudes)

    def typical_values(self, names: Collection[str] | None = None) -> dict[str, float]:
        """Typical values by parameter name."""
        return {p.name: p.typical for p in self.parameters if names is None or p.name in names}

    def as_dict(self) -> dict[str, Any]:
        """Return the catalogue's entry as plain JSON types; an infinite bound is null."""
        return {
            "name": self.name, "family": self.family, "port": self.port,
            "parameters": [
                {"name": p.name, "unit": p.unit, "lower": _finite(p.lower),
                 "upper": _finite(p.upper), "typical": p.typical, "neutral": p.neutral,
                 "meaning": p.meaning, "per_joint": p.per_joint} for p in self.parameters],
            "equation": self.equation, "signature": self.signature,
            "confused_with": [{"name": other, "experiment": experiment}
                              for other, experiment in self.confused_with.items()],
            "simulators": dict(self.simulators), "wrong": self.wrong, "passive": self.passive,
            "symmetry": self.symmetry, "per_joint": self.per_joint, "reference": self.reference}


@dataclass(frozen=True, repr=False)
class Setting:
    """An effect with its parameters, made by calling an `Effect`; `with_effects` inserts it.

    Parameters
    ----------
    effect : Effect
        The effect.
    values : dict
        Values by parameter; those left out are neutral, or typical for a shape parameter.
    joints : tuple of int or None
        Joints that have it; None for all.
    name : str
        Name of the block.

    """

    effect: Effect
    values: Mapping[str, ArrayLike]
    joints: tuple[int, ...] | None
    name: str

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={value!s}" for key, value in self.values.items())
        return f"{self.effect.name}({values})"

    def block(self, n: int, period: float = 0) -> ct.NonlinearIOSystem:
        """Build the block for n joints: a `control.NonlinearIOSystem` named `name`.

        With a period [s] it is the form for a sampled controller.
        """
        if self.joints is not None and not all(k < n for k in self.joints):
            raise DiagramError(f"{self.name}: joints {list(self.joints)} requested, but the plant "
                               f"has {n}; joints count from 0")
        block = self._built(n, period)
        if self.effect.curve is not None:
            block.icon = ("curve", Curve(self.characteristic))
        elif self.effect.symbol:
            block.icon = ("text", self.effect.symbol)
        return block

    def characteristic(self) -> tuple[np.ndarray, np.ndarray]:
        """Characteristic of the first joint: the swept signal and the output, see `path_of`.

        Raises
        ------
        DiagramError
            For an effect without such a curve.

        """
        if self.effect.curve is None:
            raise DiagramError(f"{self.name}: no single signal brings {self.effect.name} out, so "
                               "there is no characteristic; look at its response in time")
        swept, span = self.effect.curve
        build = self.effect.build
        block = (build.spring(self.vectors(1), self.name) if isinstance(build, TwoBodies)
                 else self.block(1))
        return path_of(block, swept, span)

    def _built(self, n: int, period: float) -> ct.NonlinearIOSystem:
        if period and self.effect.sampled:
            return self.effect.sampled(self.vectors(n), n, self.name, period)
        block = self.effect.build(self.vectors(n), n, self.name)
        if period and block.nstates:
            raise DiagramError(f"{self.name}: its state moves in continuous time, but the diagram "
                               f"is sampled every {period:g} s; insert it into the plant")
        return block

    def vectors(self, n: int) -> dict[str, np.ndarray]:
        """Every parameter as a vector, for n joints or for the robot as a whole."""
        vectors = {}
        for p in self.effect.parameters:
            value = vector(self.values.get(p.name, p.default), f"{self.name}: {p.name}",
                           n=n if p.per_joint else 1, unit=p.unit)
            if self.joints is not None and p.neutral is not None and p.per_joint:
                value[[k for k in range(n) if k not in self.joints]] = p.neutral
            vectors[p.name] = value
        return vectors


def _check_bounds(effect: str, parameter: Parameter, value: ArrayLike) -> None:
    array = vector(value, f"{effect}: {parameter.name}", unit=parameter.unit)
    if not np.all((parameter.lower <= array) & (array <= parameter.upper)):
        raise DiagramError(
            f"{effect}: {parameter.name} ({parameter.meaning}) must lie within "
            f"[{parameter.lower:g}, {parameter.upper:g}] {parameter.unit}, got {array}")


def _joint_list(joints: int | Sequence[int] | None) -> tuple[int, ...] | None:
    if joints is None:
        return None
    joints = tuple(np.atleast_1d(joints).tolist())
    if not all(isinstance(k, int) and k >= 0 for k in joints):
        raise DiagramError(f"joints must be whole numbers from 0, got {list(joints)}")
    return joints


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
