"""Where to look for causes between the command and the torque that leaves the motor."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Probe, Scene, cause_of
from clie_blocks.effects import LIBRARY

ACTUATOR_SATURATION = cause_of(
    LIBRARY["actuator_saturation"], ("limit",),
    lambda scene: [Probe({"limit": share * scene.peak_torque},
                         sizes={"limit": 0.1 * scene.peak_torque}) for share in (
        0.985, 0.96, 0.93, 0.89, 0.84, 0.78, 0.7, 0.6, 0.5, 0.4, 0.3)])

DEAD_ZONE = cause_of(
    LIBRARY["dead_zone"], ("width",),
    lambda scene: [Probe({"width": 0.004 * scene.torque}, ("width",))] + [
        Probe({"width": share * scene.torque}) for share in (0.012, 0.035, 0.08, 0.16, 0.32)])


def times(scene: Scene, name: str) -> list[Probe]:
    """Times of a lag or a delay."""
    return [Probe({name: t + 0 * scene.torque})
            for t in (6e-4, 1.5e-3, 3.5e-3, 8e-3, 0.016, 0.032)]


ACTUATOR_LAG = cause_of(LIBRARY["actuator_lag"], ("lag",), lambda scene: times(scene, "lag"),
                        within={"lag": (0.0, 0.3)})
LONGEST_DELAY = 0.055  # s
TIME_DELAY = cause_of(LIBRARY["time_delay"], ("delay",), lambda scene: times(scene, "delay"),
                      within={"delay": (0.0, LONGEST_DELAY)})

TORQUE_GAIN_ERROR = cause_of(
    LIBRARY["torque_gain_error"], ("error",),
    lambda scene: [Probe({"error": 0.05 + 0 * scene.torque}, ("error",))],
    within={"error": (-0.6, 1.5)})


def _ripple_probes(scene: Scene) -> list[Probe]:
    """Orders from half a wave over the travel up, and the motor's harmonics."""
    ratio = scene.problem.gear_ratio
    step = np.clip(1.2 / scene.travel.max(), 0.6, 3.0)
    least = max(3.0, 3.0 / scene.travel.max())
    orders = [order + 0 * ratio for order in np.arange(least, max(48.0, 2 * least), step)]
    orders += [multiple * ratio for multiple in (1, 2, 3, 4, 5, 6, 8)]
    size = scene.small_torque()
    return [Probe({"sine": size, "cosine": size, "order": order}, ("sine", "cosine"),
                  {"order": 1.0 / scene.travel}) for order in orders]


def counts_motor_turns(gear_ratio: float) -> bool:
    """Whether a gear ratio tells how often the motor turns per turn of the joint.

    One says nothing of the kind: robots whose torques are logged on the joint side have it, too,
    whatever their gear.
    """
    return gear_ratio != 1.0


TORQUE_RIPPLE = cause_of(
    LIBRARY["torque_ripple"], ("sine", "cosine", "order"), _ripple_probes, phase=("order",),
    within={"order": (2.0, 5000.0)})
