"""Dry friction, stated once as its largest torque against each direction of motion.

Three forms run the same statement: smoothed over a width of speed, as the block of a diagram; with
a contact that bends before it slides, see `clie_blocks.effects.sticking`; and, in the sampled
robot, as an impulse that can stop a joint but never reverse it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from clie_blocks.effects.blocks import Dynamic, Static, filled_in
from clie_blocks.effects.smoothing import direction


@dataclass(frozen=True)
class DryFriction(Static):
    """Smoothed block of a dry friction; made by `dry_friction`.

    Parameters
    ----------
    kernel : callable
        Torque of the smoothed form.
    inputs, outputs : tuple of str
        As in `Static`; ``'dq'`` is among the inputs.
    limits : callable
        ``limits(*signals, **parameters)``: largest torque against forward and against backward
        motion [N m], both positive.
    rest : callable or None
        Torque beside it that has no jump at rest [N m].

    """

    limits: Callable = field(kw_only=True)
    rest: Callable | None = None


def dry_friction(limits: Callable, inputs: tuple[str, ...],
                 rest: Callable | None = None) -> DryFriction:
    """Return the builder of a dry friction from its limits, see `DryFriction`."""
    at = inputs.index("dq")

    def torque(*signals: np.ndarray, width: np.ndarray, **parameters: np.ndarray) -> np.ndarray:
        forward, backward = filled_in(limits, parameters)(*signals)
        dq = signals[at]
        tau = np.where(dq > 0, forward, backward) * direction(dq, width)
        return tau if rest is None else filled_in(rest, parameters)(*signals) + tau

    torque.__doc__ = (f"Friction torque [N m], smoothed over a width of speed.\n\n"
                      f"{limits.__doc__}")
    return DryFriction(torque, inputs, limits=limits, rest=rest)


@dataclass(frozen=True)
class AgeingFriction(Dynamic):
    """Smoothed block of a dry friction whose limits depend on a state; see `ageing_friction`.

    Parameters
    ----------
    rate, kernel, inputs, outputs, state, size
        As in `Dynamic`; ``'dq'`` is among the inputs.
    limits : callable
        ``limits(state, *signals, **parameters)``, as in `DryFriction`.
    step : callable
        ``step(state, *signals, period, **parameters)``: the state a time `period` later.

    """

    limits: Callable = field(kw_only=True)
    step: Callable = field(kw_only=True)


def ageing_friction(limits: Callable, rate: Callable, step: Callable, inputs: tuple[str, ...],
                    state: str) -> AgeingFriction:
    """Return the builder of a dry friction with a state, see `AgeingFriction`."""
    at = inputs.index("dq")

    def torque(z: np.ndarray, *signals: np.ndarray, width: np.ndarray,
               **parameters: np.ndarray) -> np.ndarray:
        forward, backward = filled_in(limits, parameters)(z, *signals)
        dq = signals[at]
        return np.where(dq > 0, forward, backward) * direction(dq, width)

    torque.__doc__ = (f"Friction torque [N m], smoothed over a width of speed.\n\n"
                      f"{limits.__doc__}")
    return AgeingFriction(rate, torque, inputs, state=state, limits=limits, step=step)
