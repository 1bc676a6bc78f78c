"""Causes between the command and the torque that leaves the motor."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Memory, Number, Probe, Scene, Values
from clie_blocks.robot_loop.dynamics import DELAY_TAPS, Piece, State

_UNREACHED = 1e9  # N m: a limit that no command meets


def _saturation(u: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    return np.clip(u, -p["limit"], p["limit"]), z


ACTUATOR_SATURATION = Cause(
    "actuator_saturation", (Piece("drive", _saturation),),
    (Number("limit", "N m", 0.0, _UNREACHED, neutral=_UNREACHED),),
    lambda scene: [Probe({"limit": share * scene.peak_torque},
                         sizes={"limit": 0.1 * scene.peak_torque}) for share in (
        0.985, 0.96, 0.93, 0.89, 0.84, 0.78, 0.7, 0.6, 0.5, 0.4, 0.3)])


def _dead_zone(u: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    return u - np.clip(u, -p["width"], p["width"]), z


DEAD_ZONE = Cause(
    "dead_zone", (Piece("drive", _dead_zone),), (Number("width", "N m", 0.0),),
    lambda scene: [Probe({"width": 0.004 * scene.torque}, ("width",))] + [
        Probe({"width": share * scene.torque}) for share in (0.012, 0.035, 0.08, 0.16, 0.32)])


def _lag(u: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    (state,) = z
    time = np.maximum(p["time"], 1e-6)
    left = np.exp(-h / time)
    return u + (state - u) * (1.0 - left) * time / h, [u + (state - u) * left]


def _times(scene: Scene) -> list[Probe]:
    return [Probe({"time": t + 0 * scene.torque})
            for t in (6e-4, 1.5e-3, 3.5e-3, 8e-3, 0.016, 0.032)]


ACTUATOR_LAG = Cause("actuator_lag", (Piece("drive", _lag, states=1),),
                     (Number("time", "s", 0.0, 0.3),), _times)


def _delay(u: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    """Mean of the delayed staircase over a period: linear between two past commands."""
    line, samples, delayed = [u, *z], p["time"] / h, 0.0 * u
    for k, past in enumerate(line):
        delayed = delayed + np.maximum(1.0 - np.abs(samples - k), 0.0) * past
    return delayed, line[:-1]


TIME_DELAY = Cause("time_delay", (Piece("drive", _delay, states=DELAY_TAPS),),
                   (Number("time", "s", 0.0, 0.055),), _times)


def _gain(u: np.ndarray, z: Memory, p: Values, h: float) -> tuple[np.ndarray, Memory]:
    return (1.0 + p["error"]) * u, z


TORQUE_GAIN_ERROR = Cause(
    "torque_gain_error", (Piece("drive", _gain),),
    (Number("error", "1", -0.6, 1.5),),
    lambda scene: [Probe({"error": 0.05 + 0 * scene.torque}, ("error",))])


def _ripple(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    phase = p["order"] * s.q
    return p["sine"] * np.sin(phase) + p["cosine"] * np.cos(phase), z


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


TORQUE_RIPPLE = Cause(
    "torque_ripple", (Piece("load", _ripple),),
    (Number("sine", "N m"), Number("cosine", "N m"),
     Number("order", "1/turn", 2.0, 5000.0, neutral=None, phase=True)), _ripple_probes)
