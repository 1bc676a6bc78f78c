"""The drawn characteristic of an effect: its output over the signal that brings it out."""

from __future__ import annotations

from collections.abc import Iterator
from functools import wraps
from typing import TYPE_CHECKING, cast

import numpy as np

from clie_blocks.effects.blocks import Dynamic, Static
from clie_blocks.signals import ports

if TYPE_CHECKING:
    import control as ct

    from clie_blocks.effects.setting import Setting
    from clie_blocks.effects.two_bodies import TwoBodies

POINTS = 240  # of one lap
HARDLY = 0.03  # of the span


def characteristic(setting: Setting) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the characteristic of an effect with its parameters, as a path ``x, y``.

    The signal of the effect's `curve` goes through a sine: a law with memory shows its loop on
    the second lap.  A position moves with its own velocity; time runs straight; all other
    signals are one.  An output that hardly departs from the signal it replaces is drawn as that
    departure.

    Parameters
    ----------
    setting : clie_blocks.effects.setting.Setting
        The effect; its first joint is drawn.

    Returns
    -------
    tuple of ndarray or None
        The swept signal and the first output; None for an effect without such a curve.

    """
    if setting.effect.curve is None:
        return None
    swept, span = setting.effect.curve
    block = _spring(setting) if swept == "twist" else setting.block(1)
    inputs = list(ports(block.input_labels))
    angle = np.linspace(0.0, 4 * np.pi, 2 * POINTS + 1)
    values = {name: np.ones_like(angle) for name in inputs}
    t = np.linspace(0.0, span, angle.size) if swept == "t" else angle
    values[swept] = t if swept == "t" else span * np.sin(angle)
    if swept in ("q", "twist"):
        values[f"d{swept}"] = span * np.cos(angle)
    y = _outputs(block, t, np.stack([values[name] for name in inputs], axis=1)
                 if inputs else np.zeros((angle.size, 0)))
    x, shown = values[swept], slice(None) if swept == "t" else slice(POINTS, None)
    if block.output_labels[0] == f"{swept}[0]" and np.max(np.abs(y - x)) < HARDLY * span:
        y = y - x
    return x[shown], y[shown]


class Curve:
    """Characteristic that is worked out when it is drawn: ``x, y = Curve(setting)``."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    def __iter__(self) -> Iterator[np.ndarray]:
        return iter(characteristic(self.setting) or ())


def _spring(setting: Setting) -> ct.NonlinearIOSystem:
    """Return the spring between the two bodies of a transmission as a block of its own."""
    build, values = cast("TwoBodies", setting.effect.build), setting.vectors(1)
    memory = build.memory
    if memory is None:
        return Static(build.kernel, ("twist", "dtwist"))(values, 1, setting.name)

    @wraps(memory)
    def rate(z: np.ndarray, twist: np.ndarray, speed: np.ndarray,
             **parameters: np.ndarray) -> np.ndarray:
        return memory(z, speed, **parameters)

    @wraps(build.kernel)
    def torque(z: np.ndarray, twist: np.ndarray, speed: np.ndarray,
               **parameters: np.ndarray) -> np.ndarray:
        return build.kernel(twist, speed, z, **parameters)

    return Dynamic(rate, torque, ("twist", "dtwist"))(values, 1, setting.name)


def _outputs(block: ct.NonlinearIOSystem, t: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """First output along the rows, the state carried by Heun's method."""
    x, found = np.zeros(block.nstates), []
    for k, u in enumerate(rows):
        found.append(block.output(t[k], x, u)[0])
        if block.nstates and k + 1 < len(rows):
            h = t[k + 1] - t[k]
            slope = block.dynamics(t[k], x, u)
            x = x + h / 2 * (slope + block.dynamics(t[k + 1], x + h * slope, rows[k + 1]))
    return np.array(found)
