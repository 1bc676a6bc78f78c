"""Where to look for causes in the measured position."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Probe, Scene, cause_of
from clie_blocks.analysis.gap.causes.drive import LONGEST_DELAY, counts_motor_turns
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.delay import DelayLine, constant_delay

_WORST = 0.02  # rad: a degree of eccentricity


def _probes(scene: Scene) -> list[Probe]:
    shaft = scene.problem.shaft_ratio
    size = 1e-4 + 0 * shaft
    orders = {tuple(order) for order in (1 + 0 * shaft, 2 + 0 * shaft, shaft, 2 * shaft)}
    return [Probe({"sine": size, "cosine": size, "order": np.array(order)}, ("sine", "cosine"))
            for order in sorted(orders)]


def _gear_probes(scene: Scene) -> list[Probe]:
    """Once and twice per turn of the motor, as harmonic drives err, and their double."""
    problem, size = scene.problem, 1e-4 + 0 * scene.torque
    geared = any(counts_motor_turns(ratio) for ratio in problem.gear_ratio)
    return [Probe({"sine": size, "cosine": size, "order": turns * problem.gear_ratio},
                  ("sine", "cosine")) for turns in (1, 2, 4)] if geared else []


KINEMATIC_ERROR = cause_of(
    LIBRARY["kinematic_error"], ("sine", "cosine", "order"), _gear_probes, fixed=("order",),
    within={"sine": (-_WORST, _WORST), "cosine": (-_WORST, _WORST)})
ENCODER_ECCENTRICITY = cause_of(
    LIBRARY["encoder_eccentricity"], ("sine", "cosine", "order"), _probes, fixed=("order",),
    within={"sine": (-_WORST, _WORST), "cosine": (-_WORST, _WORST)})
COUPLED_JOINTS = cause_of(
    LIBRARY["coupled_joints"], ("ratio",),
    lambda scene: [Probe({"ratio": 1e-3 + 0 * scene.torque}, ("ratio",))] * (scene.problem.n > 1),
    within={"ratio": (-1.5, 1.5)})
# A delayed encoder acts as a delayed drive until one joint pushes another: the push comes in time.
ENCODER_DELAY = cause_of(
    dataclasses.replace(LIBRARY["time_delay"], port="sensor",
                        sampled=DelayLine(("q",), constant_delay, longest="delay")),
    ("delay",), lambda scene: [], within={"delay": (0.0, LONGEST_DELAY)}, variant="encoder",
    needs_links=True)
