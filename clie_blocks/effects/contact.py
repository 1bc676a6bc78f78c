"""Dry friction that truly sticks: its limits, driven by a contact instead of a width."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.effects.blocks import Dynamic, filled_in
from clie_blocks.effects.dry_friction import DryFriction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.presliding import bristle_rate, returned_share
from clie_blocks.labels import DiagramError, PerJoint

if TYPE_CHECKING:
    import control as ct

ELASTIC = 0.9  # share of the bending up to which a contact springs back

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
    """Builder of a block: the limits of a dry friction, the direction of a contact.

    Parameters
    ----------
    law : DryFriction
        Builder of the smoothed form.

    """

    law: DryFriction

    @property
    def kernel(self) -> Callable:
        """Kernel of the smoothed form."""
        return self.law.kernel

    @property
    def outputs(self) -> tuple[str, ...]:
        """Signals it gives."""
        return self.law.outputs

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""
        law, at = self.law, self.law.inputs.index("dq")

        def rate(z: np.ndarray, *signals: np.ndarray, reach: np.ndarray,
                 fastest: np.ndarray) -> np.ndarray:
            return contact_rate(z, signals[at], reach, fastest)

        def torque(z: np.ndarray, *signals: np.ndarray, reach: np.ndarray, relaxation: np.ndarray,
                   fastest: np.ndarray, **parameters: np.ndarray) -> np.ndarray:
            forward, backward = filled_in(law.limits, parameters)(*signals)
            held = np.where(z < 0, backward, forward) * contact_direction(
                z, signals[at], reach, relaxation, fastest)
            return held if law.rest is None else filled_in(law.rest, parameters)(*signals) + held

        return Dynamic(rate, torque, self.law.inputs)(values, n, name)


def sticking(effect: Effect) -> Effect:
    """Return a dry friction of the catalogue in the form that sticks.

    Below break-away the joint is held by a contact spring of stiffness level / reach: it moves by
    up to `reach`, and back.  Stable at steps below ``2 sqrt(reach / (B level))`` and
    ``2 reach / (B level relaxation)``, with B one over the inertia, and ``2 / fastest``.

    Parameters
    ----------
    effect : Effect
        One that states limits, see `dry_friction`.

    Returns
    -------
    Effect
        Of the same name, with `reach`, `relaxation` and `fastest` in the place of `width`.

    Raises
    ------
    DiagramError
        For an effect that is not a dry friction.

    """
    if not isinstance(effect.build, DryFriction):
        raise DiagramError(f"{effect.name} has no form that sticks: it is no dry friction; "
                           "coulomb, stribeck and their kin are")
    return replace(
        effect, build=Contact(effect.build),
        parameters=(*(p for p in effect.parameters if p.name != "width"), *_CONTACT),
        equation=effect.equation + ", with z/reach of an elastic contact for tanh(dq / width)",
        wrong="A stuck joint gives way by up to reach and springs back; after a reversal above "
              "the speed reach fastest the torque turns around within 3/fastest.")
