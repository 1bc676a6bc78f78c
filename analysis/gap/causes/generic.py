"""Where to look for an effect that says nothing else: a grid over its shape within its bounds.

An amplitude in which the kernel is linear is found by regression on a simulated column; any other
parameter is tried at a few values around its typical one.
"""

import itertools
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Probe, Scene, cause_of
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter

STEPS = (0.25, 1.0, 4.0)  # times the typical value
MOST_PROBES = 36
_PROBED_AT = np.linspace(-1.3, 1.7, 41)[:, None]  # signals at which a kernel is asked


def generic_cause(effect: Effect) -> Cause:
    """Return the cause of an effect with a form for the sampled robot.

    Raises
    ------
    DiagramError
        If it has none.

    """
    free = [p.name for p in effect.parameters if p.of == "effect"]
    return cause_of(effect, free, lambda scene: probes(effect, scene))


def probes(effect: Effect, scene: Scene) -> list[Probe]:
    """Points of the search grid."""
    own = [p for p in effect.parameters if p.of == "effect"]
    linear = [p for p in own if p.neutral == 0.0 and is_linear(effect, p)]
    others = [p for p in own if p not in linear]
    grids = [_values(p) for p in others]
    points = list(itertools.islice(itertools.product(*grids), MOST_PROBES))
    every = np.ones_like(scene.torque)
    return [Probe({**{p.name: size(p, scene) for p in linear},
                   **{p.name: value * every for p, value in zip(others, point)}},
                  tuple(p.name for p in linear)) for point in points]


def _values(p: Parameter) -> list[float]:
    """Values around the typical one, within the bounds."""
    around = [p.typical * step for step in STEPS] if p.typical else [p.lower, 0.0, p.upper]
    return sorted({float(np.clip(value, p.lower, p.upper)) for value in around})


def is_linear(effect: Effect, amplitude: Parameter) -> bool:
    """Whether what an effect adds is in proportion to one of its parameters."""
    def change(value: float) -> np.ndarray:
        chosen: dict[str, Any] = {amplitude.name: value}
        block = effect.typical(**chosen).block(1)
        rows = [block.output(0.3, np.full(block.nstates, 0.01), np.full(block.ninputs, x))
                for x in _PROBED_AT.ravel()]
        return np.array(rows)

    without, once, twice = (change(step * amplitude.typical) for step in (0.0, 1.0, 2.0))
    return bool(np.allclose(twice - without, 2.0 * (once - without), rtol=1e-9, atol=1e-12))


def size(p: Parameter, scene: Scene) -> np.ndarray:
    """Size of an amplitude at which a column is simulated: a small part of the robot's torque."""
    torque = scene.small_torque()
    by_unit = {"N m": torque, "N m/rad": torque / scene.travel, "N m s/rad": torque / scene.speed,
               "N m s^2/rad^2": torque / scene.speed**2, "N m s^3/rad^3": torque / scene.speed**3,
               "rad": 1e-3 * scene.travel, "1": 0.03 + 0 * torque}
    return by_unit.get(p.unit, 0.1 * abs(p.typical) + 0 * torque)
