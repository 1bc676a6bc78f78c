"""Logs of a two-link arm with a known fault, of any length, for timing the diagnosis.

They come from the diagnosis' own simulator: they measure its speed, not its accuracy, which
blind trials by another engine measure.
"""

import dataclasses
from pathlib import Path

import numpy as np

from clie_blocks import gap
from clie_blocks.analysis.gap import Problem
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.linear_filters import lfilter

RATE = 1000  # Hz
NOISE = 1e-4  # rad
POSE = np.array([0.6, 0.1])
ROBOT = """\
joints = 2
[motor]
gear_ratio = [100.0, 100.0]
inertia_kgm2 = [0.02, 0.02]
viscous_friction_nms = [0.04, 0.04]
inertia_tolerance = 0.01
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = [0.1, 0.1]
[links]
length_m = [0.6, 0.6]
mass_kg = [0.5, 0.5]
com_m = [0.6, 0.6]
inertia_kgm2 = [0.004, 0.004]
joint_viscous_friction_nms = [4.0, 4.0]
[nominal]
gravity = true
coupling = true
[controller]
Kp = [10.0, 10.0]
Kd = [5.0, 5.0]
velocity_filter_highpass_rad_s = 200.0
velocity_filter_lowpass_rad_s = 300.0
velocity_filter_discretisation = "tustin"
sample_time_s = 0.001
command_resolution_nm = 0.002
[encoder]
resolution_rad = 2e-5
"""
FAULTS = {
    "one effect": ({"coulomb": {"level": [0.05, 0.0]}}, 0.0),
    "two effects": ({"spring": {"stiffness": [0.5, 0.0]},
                     "actuator_lag": {"lag": [0.01, 0.01]}}, 0.0),
    "unexplained": ({}, 0.15)}


def write_trial(folder: Path, seconds: float, fault: str) -> None:
    """Write ``robot.toml`` and three logs.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    seconds : float
        Length of each log [s].
    fault : str
        One of `FAULTS`: effects with their parameters, RMS of an unstructured torque [N m].

    """
    causes, unknown = FAULTS[fault]
    rng = np.random.default_rng(7)
    starts = "".join(f"[experiment.log-{j}]\nstart_rad = {POSE.tolist()}\n"
                     f"set_point_rad = {POSE.tolist()}\n" for j in (1, 2, 3))
    (folder / "robot.toml").write_text(ROBOT + starts)
    time = np.arange(round(seconds * RATE) + 1)[:, None] / RATE
    commands = _commands(time)
    for j, (q_d, pe) in enumerate(commands, 1):
        _write(folder / f"log-{j}.csv.gz", time, q_d, 0.0 * pe, q_d, pe)
    asked = gap.read(folder, trust_logs=True)  # of logs whose commands are still to come
    at = build_hypothesis(asked, [_member(asked, name, values) for name, values in causes.items()])
    for j, (log, (q_d, pe)) in enumerate(zip(asked.logs, commands), 1):
        noise = NOISE * rng.standard_normal(pe.shape)
        pushed = dataclasses.replace(log, dither=noise, pe=pe + unknown * _wandering(rng, time))
        q, u = at.simulator.run(pushed, at.of_log(0))
        _write(folder / f"log-{j}.csv.gz", time, q + noise, u - (pushed.pe - pe), q_d, pe)


def _member(asked: Problem, name: str, values: dict[str, list[float]]) -> Member:
    cause, = (cause for cause in CAUSES if cause.key == name)
    values = {number.name: np.array(values[number.name]) for number in cause.numbers}
    return Member(cause, tuple(range(asked.n)), values, values)


def _commands(time: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Set-points and excitations: slow triangles, a multisine, a chirp, one per log."""
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / np.array([6.4, 11.4])))
    lines = np.geomspace(0.06, 4.0, 10)
    multisine = sum(np.sin(2 * np.pi * f * time * np.array([1.0, 1.07]) + k**2)
                    for k, f in enumerate(lines))
    sweep = np.sin(2 * np.pi * (0.1 * time + 4.9 * time**2 / (2 * time[-1])))
    still = POSE + 0.0 * time
    return [(POSE + 0.35 * triangle, 0.0 * still), (still, 1.2 * multisine + 0.0 * still),
            (still, 2.5 * sweep + 0.0 * still)]


def _wandering(rng: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """Random torque below some 1 Hz, of size one."""
    kept = np.exp(-2 * np.pi / RATE)
    return lfilter([np.sqrt(1 - kept**2)], [1.0, -kept], rng.standard_normal((len(time), 2)))


def _write(path: Path, time: np.ndarray, q: np.ndarray, u: np.ndarray, q_d: np.ndarray,
           pe: np.ndarray) -> None:
    names = [f"{signal}{k}" for signal in ("q", "u", "qd", "pe") for k in (1, 2)]
    np.savetxt(path, np.hstack([time, np.round(q, 6), np.round(u, 4), q_d, pe]), fmt="%.7g",
               delimiter=",", header=",".join(["time", *names]), comments="")
