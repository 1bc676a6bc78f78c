"""Where to look for causes between the command and the torque that leaves the motor."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Probe, Scene, cause_of, waves_over_travel
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


def _no_probes(scene: Scene) -> list[Probe]:
    """None: `search.drive_faults` reads where to look from the logged commands."""
    return []


TICK_JITTER = cause_of(
    LIBRARY["tick_jitter"], ("spread", "beat", "phase"), _no_probes, per_log=("phase",),
    phase=("beat", "phase"), within={"spread": (0.0, LONGEST_DELAY), "beat": (0.02, 100.0)})
PACKET_HOLD = cause_of(
    LIBRARY["packet_hold"], ("hold", "interval", "phase"), _no_probes,
    fixed=("interval", "phase"), per_log=("phase",))
TORQUE_QUANTIZATION = cause_of(LIBRARY["torque_quantization"], ("resolution",), _no_probes)

TORQUE_GAIN_ERROR = cause_of(
    LIBRARY["torque_gain_error"], ("error",),
    lambda scene: [Probe({"error": 0.05 + 0 * scene.torque}, ("error",))],
    within={"error": (-0.6, 1.5)})


def _ripple_probes(scene: Scene, size: np.ndarray) -> list[Probe]:
    """Orders from half a wave over the travel up, and the motor's harmonics."""
    ratio = scene.problem.gear_ratio
    orders = waves_over_travel(scene)
    orders += [multiple * ratio for multiple in (1, 2, 3, 4, 5, 6, 8)]
    return [Probe({"sine": size, "cosine": size, "order": order}, ("sine", "cosine"),
                  {"order": 1.0 / scene.travel}) for order in orders]


def counts_motor_turns(gear_ratio: float) -> bool:
    """Whether a gear ratio tells how often the motor turns per turn of the joint.

    One says nothing of the kind: robots whose torques are logged on the joint side have it, too,
    whatever their gear.
    """
    return gear_ratio != 1.0


TORQUE_RIPPLE = cause_of(
    LIBRARY["torque_ripple"], ("sine", "cosine", "order"),
    lambda scene: _ripple_probes(scene, scene.small_torque()), phase=("order",),
    within={"order": (2.0, 5000.0)})
COMMUTATION_RIPPLE, GEAR_MESH_RIPPLE = (
    cause_of(LIBRARY[name], ("sine", "cosine", "order"),
             lambda scene: _ripple_probes(scene, 0.03 + 0 * scene.torque), phase=("order",),
             within={"order": (2.0, 5000.0)})
    for name in ("commutation_ripple", "gear_mesh_ripple"))


def _envelope_probes(scene: Scene) -> list[Probe]:
    """Torques at standstill and no-load speeds beyond the largest ones that were met."""
    return [Probe({"peak": peak * scene.peak_torque, "droop": 1.0 / (fastest * scene.top_speed)},
                  sizes={"peak": 0.1 * scene.peak_torque, "droop": 0.1 / scene.top_speed})
            for peak in (0.9, 1.2, 1.6, 2.5) for fastest in (1.1, 1.4, 2.0, 4.0)]


TORQUE_SPEED_LIMIT = cause_of(
    LIBRARY["torque_speed_limit"], ("peak", "droop"), _envelope_probes)
SUPPLY_SAG = cause_of(
    LIBRARY["supply_sag"], ("sag",),
    lambda scene: [Probe({"sag": 0.03 / scene.torque.sum() + 0 * scene.torque}, ("sag",))])


def _heating_probes(scene: Scene) -> list[Probe]:
    """Motors that lose a few percent of their torque at the mean of its square."""
    loss = 0.03 / (LIBRARY["motor_heating"].typical_values()["fade"] * scene.torque**2)
    return [Probe({"heating": loss, "time_constant": time + 0 * loss}, ("heating",))
            for time in (3.0, 10.0, 30.0, 100.0)]


MOTOR_HEATING = cause_of(
    LIBRARY["motor_heating"], ("heating", "time_constant"), _heating_probes,
    within={"time_constant": (1.0, 1000.0)})
