"""Where to look for causes between the command and the torque that leaves the motor."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    Cause,
    Memory,
    Probe,
    Scene,
    Values,
    cause_of,
    waves_over_travel,
)
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.torque_slew import mean_slewed_torque, slewed_torque_step
from clie_blocks.measurement import quantized
from clie_blocks.robot_loop.dynamics import Piece, State

ACTUATOR_SATURATION = cause_of(
    LIBRARY["actuator_saturation"], ("limit",),
    lambda scene: [Probe({"limit": share * scene.peak_torque},
                         sizes={"limit": 0.1 * share * scene.peak_torque}) for share in (
        0.985, 0.96, 0.93, 0.89, 0.84, 0.78, 0.7, 0.6, 0.5, 0.4, 0.3,
        0.2, 0.12, 0.07, 0.04, 0.02)])  # a loop asks for many times what a weak drive gives


def _recorded(s: State) -> np.ndarray:
    """Recorded command [N m]; that of the model where there is no record."""
    return s.u if s.recorded is None else np.where(np.isnan(s.recorded), s.u, s.recorded)


def _slew_probes(scene: Scene) -> list[Probe]:
    """Rates from the largest of the commands, which a jump exceeds for a sample, to usual ones."""
    steps = np.abs(np.diff(scene.u, axis=0)) / scene.problem.period
    usual, largest = np.quantile(steps, 0.6, axis=0) + 1e-9, steps.max(axis=0) + 1e-9
    return [Probe({"rate": rate}, sizes={"rate": 0.1 * rate})
            for rate in np.geomspace(0.7 * largest, usual, 10)]


def _slewed_as_recorded(torque: Callable[..., np.ndarray]) -> Callable[..., Any]:
    """Torque that lags behind as it does behind the recorded command.

    Noise in the command changes it by more than the limit allows, so that the limit acts on the
    noise; a model's own command has none.
    """
    def act(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
        recorded = _recorded(s)
        before = np.where(s.t < 0.5 * s.h, recorded, z[0])  # a log may begin under load
        lagging = torque(before, recorded, p["rate"], s.h)
        return s.u + lagging - recorded, [slewed_torque_step(before, recorded, p["rate"], s.h)]
    act.__qualname__ = f"slewed as recorded, {torque.__name__}"
    return act


def _torque_slew(torque: Callable[..., np.ndarray], variant: str = "") -> Cause:
    return dataclasses.replace(
        cause_of(LIBRARY["torque_slew"], ("rate",), _slew_probes, variant=variant),
        pieces=(Piece("drive", _slewed_as_recorded(torque), states=1, reads_record=True),))


TORQUE_SLEW = _torque_slew(mean_slewed_torque), _torque_slew(slewed_torque_step, "once a sample")
"""A limit that the drive keeps all the time, and one that it keeps from command to command."""

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
LONGEST_DELAY = 0.12  # s
_LONG_DELAY = 0.075  # s, that is tried as well
TIME_DELAY = cause_of(
    LIBRARY["time_delay"], ("delay",), lambda scene: [
        *times(scene, "delay"), Probe({"delay": _LONG_DELAY + 0 * scene.torque})],
    within={"delay": (0.0, LONGEST_DELAY)})


def _no_probes(scene: Scene) -> list[Probe]:
    """None: `search.drive_faults` reads where to look from the logged commands."""
    return []


OLDEST_COMMAND = 0.055  # s, on which a drive whose clock beats may act
TICK_JITTER = cause_of(
    LIBRARY["tick_jitter"], ("spread", "beat", "phase"), _no_probes, per_log=("phase",),
    phase=("beat", "phase"), within={"spread": (0.0, OLDEST_COMMAND), "beat": (0.02, 100.0)})
PACKET_HOLD = cause_of(
    LIBRARY["packet_hold"], ("hold", "interval", "phase"), _no_probes,
    fixed=("interval", "phase"), per_log=("phase",))


def _rounded_as_recorded(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    """Torque with the rounding of the recorded command.

    A model's own command passes a step some samples sooner or later than the robot's did, and
    each such sample has a torque that is wrong by a whole step.  No fit moves the step, and it is
    small beside the commands: a large one would take the recorded torque off, and with it what
    the robot's law knew of any other effect.
    """
    recorded = _recorded(s)
    return s.u + quantized(recorded, p["resolution"]) - recorded, z


TORQUE_QUANTIZATION = dataclasses.replace(
    cause_of(LIBRARY["torque_quantization"], ("resolution",), _no_probes, fixed=("resolution",)),
    pieces=(Piece("drive", _rounded_as_recorded, reads_record=True),))

TORQUE_GAIN_ERROR = cause_of(
    LIBRARY["torque_gain_error"], ("error",),
    lambda scene: [Probe({"error": 0.05 + 0 * scene.torque}, ("error",))],
    within={"error": (-0.6, 1.5)})


def _of_motor(scene: Scene) -> list[np.ndarray]:
    """Harmonics of the motor's turn; `search.ripple_spectrum` finds all other orders."""
    return [multiple * scene.problem.gear_ratio for multiple in (1, 2, 3, 4, 5, 6, 8)]


def _ripple_probes(scene: Scene, orders: list[np.ndarray], **values: np.ndarray) -> list[Probe]:
    """Sine and cosine of some orders."""
    return [Probe({**values, "order": order}, ("sine", "cosine"), {"order": 1.0 / scene.travel})
            for order in orders]


def _cogging_probes(scene: Scene) -> list[Probe]:
    """Orders from half a wave over the travel up, and the motor's harmonics."""
    size = scene.small_torque()
    return _ripple_probes(scene, [*waves_over_travel(scene), *_of_motor(scene)],
                          sine=size, cosine=size)


def _commutation_probes(scene: Scene) -> list[Probe]:
    share = 0.03 + 0 * scene.torque
    return _ripple_probes(scene, _of_motor(scene), sine=share, cosine=share)


def _mesh_probes(scene: Scene) -> list[Probe]:
    """Teeth of the gear that carry the load, and half as much of their own."""
    share = 0.03 + 0 * scene.torque
    return _ripple_probes(scene, _of_motor(scene), sine=share, cosine=share,
                          preload=PRELOAD * scene.torque)


def counts_motor_turns(gear_ratio: float) -> bool:
    """Whether a gear ratio tells how often the motor turns per turn of the joint.

    One says nothing of the kind: robots whose torques are logged on the joint side have it, too,
    whatever their gear.
    """
    return gear_ratio != 1.0


_ORDERS = {"order": (2.0, 1e4)}
PRELOAD = 0.5  # of the RMS torque, from which a search for the teeth of a gear starts
_MOST_PRELOAD = 3.0  # of the same: beyond that the wave hardly grows with the load, as of cogging
TORQUE_RIPPLE = cause_of(
    LIBRARY["torque_ripple"], ("sine", "cosine", "order"),
    _cogging_probes, phase=("order",), within=_ORDERS)
COMMUTATION_RIPPLE = cause_of(
    LIBRARY["commutation_ripple"], ("sine", "cosine", "order"), _commutation_probes,
    phase=("order",), within=_ORDERS)
GEAR_MESH_RIPPLE = cause_of(
    LIBRARY["gear_mesh_ripple"], ("sine", "cosine", "order", "preload"), _mesh_probes,
    phase=("order",), within=_ORDERS, most_torque={"preload": _MOST_PRELOAD})


def _envelope_probes(scene: Scene) -> list[Probe]:
    """Envelopes of some no-load speeds, each as high as a share of the motion would still meet."""
    drives = scene.u * scene.dq > 0
    probes = []
    for fastest in (1.02, 1.2, 1.5, 2.0, 4.0):
        droop = 1.0 / (fastest * np.abs(scene.dq).max(axis=0))
        standstill = np.where(drives, np.abs(scene.u) / (1.0 - droop * np.abs(scene.dq)), 0.0)
        probes += [Probe({"peak": np.quantile(standstill, 1.0 - share, axis=0), "droop": droop},
                         sizes={"peak": 0.1 * scene.peak_torque, "droop": 0.1 / scene.top_speed})
                   for share in (2e-3, 1e-2, 5e-2, 0.15)]
    return probes


TORQUE_SPEED_LIMIT = cause_of(
    LIBRARY["torque_speed_limit"], ("peak", "droop"), _envelope_probes,
    without=("actuator_saturation", "droop"))
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
