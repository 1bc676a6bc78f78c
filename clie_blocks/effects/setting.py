"""An effect with its parameters set, ready to become a block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.effects.characteristic import Curve
from clie_blocks.signals import DiagramError, vector

if TYPE_CHECKING:
    import control as ct

    from clie_blocks.effects.effect import Effect


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
            block.icon = ("curve", Curve(self))
        elif self.effect.symbol:
            block.icon = ("text", self.effect.symbol)
        return block

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
            default = p.typical if p.neutral is None else p.neutral
            value = vector(self.values.get(p.name, default), f"{self.name}: {p.name}",
                           n=n if p.per_joint else 1, unit=p.unit)
            if self.joints is not None and p.neutral is not None and p.per_joint:
                value[[k for k in range(n) if k not in self.joints]] = p.neutral
            vectors[p.name] = value
        return vectors
