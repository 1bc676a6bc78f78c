"""The drawn characteristic of an effect: its output over the signal that brings it out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.labels import ports

if TYPE_CHECKING:
    import control as ct

POINTS = 240  # of one lap
HARDLY = 0.03  # of the span


def path_of(block: ct.NonlinearIOSystem, swept: str, span: float) -> tuple[np.ndarray, np.ndarray]:
    """Characteristic of a block of one joint as a path: the swept signal and the first output.

    The signal goes through a sine of amplitude `span`: a law with memory shows its loop on the
    second lap.  A position moves with its own velocity; time runs straight; all other signals are
    one.  An output that hardly departs from the signal it replaces is drawn as that departure.
    """
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
    """Path that is worked out when it is drawn: ``x, y = Curve(setting.characteristic)``."""

    def __init__(self, path: Callable[[], tuple[np.ndarray, np.ndarray]]) -> None:
        self.path = path

    def __iter__(self) -> Iterator[np.ndarray]:
        return iter(self.path())


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
