"""Dry friction that truly sticks: the smoothed laws, driven by a contact instead of a width."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from clie_blocks.effects.blocks import Dynamic, Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.presliding import bristle_rate, returned_share
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError, PerJoint

if TYPE_CHECKING:
    import control as ct

DRY = ("coulomb", "stribeck", "asymmetric_coulomb", "load_dependent_friction",
       "position_dependent_friction", "directional_efficiency")
ELASTIC = 0.9
SLOW, NO_WIDTH = 1e-9, 1e-12  # rad/s: a joint this slow still has the level of one at rest

_CONTACT = (
    Parameter("reach", "rad", 1e-7, 0.1, 1e-5, None, "bending of the contact that slides"),
    Parameter("relaxation", "s", 0.0, 1.0, 1e-3, None, "damping over stiffness while stuck"),
    Parameter("fastest", "1/s", 1.0, 1e6, 1000.0, None, "bound on the rate of the contact"),
)


def contact_rate(z: np.ndarray, dq: np.ndarray, reach: PerJoint, fastest: PerJoint) -> np.ndarray:
    """Rate of the contact's bending z [rad/s]: elastic up to nine tenths of `reach`."""
    return bristle_rate(z, dq, 1.0, 1.0, reach, ELASTIC, fastest)


def contact_direction(z: np.ndarray, dq: np.ndarray, reach: PerJoint, relaxation: PerJoint,
                      fastest: PerJoint) -> np.ndarray:
    """Direction of the friction torque, -1 to 1: the bending over `reach`, damped while stuck."""
    damping = relaxation * np.exp(-(dq / (reach * fastest)) ** 2)
    return (z * returned_share(z, dq, reach, fastest)
            + damping * contact_rate(z, dq, reach, fastest)) / reach


@dataclass(frozen=True)
class Contact:
    """Builder of a block: the level of a smoothed law, the direction of a contact.

    Parameters
    ----------
    law : Static
        Builder of the smoothed law; its kernel is odd in the direction of motion and has the
        parameter `width`.

    """

    law: Static

    @property
    def kernel(self) -> Callable:
        """Kernel of the smoothed law, of which this one takes the level."""
        return self.law.kernel

    @property
    def outputs(self) -> tuple[str, ...]:
        """Signals it gives."""
        return self.law.outputs

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""
        law, at = self.law.kernel, self.law.inputs.index("dq")

        def rate(z: np.ndarray, *signals: np.ndarray, reach: np.ndarray,
                 fastest: np.ndarray) -> np.ndarray:
            return contact_rate(z, signals[at], reach, fastest)

        def torque(z: np.ndarray, *signals: np.ndarray, reach: np.ndarray, relaxation: np.ndarray,
                   fastest: np.ndarray, **parameters: np.ndarray) -> np.ndarray:
            dq = signals[at]
            moving = np.where(z < 0, -1.0, 1.0) * np.maximum(np.abs(dq), SLOW)
            level = law(*signals[:at], moving, *signals[at + 1:], width=NO_WIDTH, **parameters)
            return np.abs(level) * contact_direction(z, dq, reach, relaxation, fastest)

        return Dynamic(rate, torque, self.law.inputs)(values, n, name)


def sticking(effect: Effect) -> Effect:
    """Return a dry friction of the catalogue in the form that sticks.

    Below break-away the joint is held by a contact spring of stiffness level / reach: it moves by
    up to `reach`, and back.  Stable at steps below ``2 sqrt(reach / (B level))`` and
    ``2 reach / (B level relaxation)``, with B one over the inertia, and ``2 / fastest``.

    Parameters
    ----------
    effect : Effect
        One of `DRY`.

    Returns
    -------
    Effect
        Of the same name, with `reach`, `relaxation` and `fastest` in the place of `width`.

    Raises
    ------
    DiagramError
        For an effect that is not a dry friction.

    """
    if effect.name not in DRY:
        raise DiagramError(f"{effect.name} has no form that sticks; {nearest(effect.name, DRY)}")
    return replace(
        effect, build=Contact(cast("Static", effect.build)),
        parameters=(*(p for p in effect.parameters if p.name != "width"), *_CONTACT),
        equation=effect.equation + ", with z/reach of an elastic contact for tanh(dq / width)",
        wrong="A stuck joint gives way by up to reach and springs back; after a reversal above "
              "the speed reach fastest the torque turns around within 3/fastest.")
