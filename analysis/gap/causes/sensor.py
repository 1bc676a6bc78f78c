"""Causes in the measured position."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Memory, Number, Probe, Scene, Values
from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.robot_loop.dynamics import Piece

_WORST = 0.02  # rad: a degree of eccentricity


def _eccentric(q: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    phase = p["order"] * q
    return q + p["sine"] * np.sin(phase) + p["cosine"] * np.cos(phase), z


def _probes(scene: Scene) -> list[Probe]:
    shaft = scene.problem.shaft_ratio
    size = 1e-4 + 0 * shaft
    orders = {tuple(order) for order in (1 + 0 * shaft, 2 + 0 * shaft, shaft, 2 * shaft)}
    return [Probe({"sine": size, "cosine": size, "order": np.array(order)}, ("sine", "cosine"))
            for order in sorted(orders)]


ENCODER_ECCENTRICITY = Cause(
    "encoder_eccentricity", (Piece("sensor", _eccentric),),
    (Number("sine", "rad", -_WORST, _WORST), Number("cosine", "rad", -_WORST, _WORST),
     Number("order", "1/turn", fixed=True, neutral=None)), _probes)
# A delayed encoder acts as a delayed drive until one joint pushes another: the push comes in time.
ENCODER_DELAY = Cause(
    "time_delay", (dataclasses.replace(TIME_DELAY.pieces[0], port="sensor"),), TIME_DELAY.numbers,
    lambda scene: [], variant="encoder", needs_links=True)
