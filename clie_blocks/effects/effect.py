"""What the catalogue knows of an effect: physics, parameters, how to tell it from others."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.effects.setting import Setting
from clie_blocks.errors import nearest
from clie_blocks.signals import DiagramError, vector

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


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : str
        Keyword of the kernel; in a block the key is ``'<block>.<name>'``.
    unit : str
        SI unit, ``'1'`` for a pure number.
    lower, upper : float
        Bounds; values outside are refused.
    typical : float
        A value met on real joints.
    neutral : float or None
        The value that removes the effect bit for bit.  None for a shape parameter (a width, a
        frequency), which removes nothing on its own and takes `typical` when it is left out.
    meaning : str
        One phrase.
    per_joint : bool
        One value per joint; otherwise one value for the robot.

    """

    name: str
    unit: str
    lower: float
    upper: float
    typical: float
    neutral: float | None
    meaning: str
    per_joint: bool = True


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
