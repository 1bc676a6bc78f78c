"""A trial as a folder that does not reveal its effect: ``robot.toml`` and three logs."""

import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clie_blocks.analysis.blind.engine.experiments import Experiment
from clie_blocks.analysis.blind.engine.parameters import G
from clie_blocks.analysis.blind.engine.robot import LINKS_UNSTATED, DrawnRobot
from clie_blocks.analysis.blind.engine.spatial_links import MASS_TOLERANCE
from clie_blocks.analysis.blind.population.maker import Trial
from clie_blocks.analysis.blind.population.model_files import TOOL, model_text
from clie_blocks.output import write

_NAMES = {"arm": "planar arm", "pendulum": "servo with pendulum load",
          "axes": "axes side by side", "spatial": "balanced arm on a turntable",
          "articulated": "arm in space", "drives": "arm in space, drives alone"}

LEVEL = 6  # of packing: 9 takes five times as long and saves 2 %


def write_trial(trial: Trial, folder: Path) -> None:
    """Write what the diagnosis may see."""
    for j, (experiment, (q, u)) in enumerate(zip(trial.experiments, trial.runs)):
        text = _log(trial.robot, experiment, q, u, trial.others[j] if trial.others else None)
        packed = gzip.compress(text.encode(), LEVEL, mtime=0)
        write(folder / f"log-{j + 1}.csv.gz", packed)
    if trial.robot.links is not None:
        write(folder / trial.robot.links.file, model_text(trial.robot.links))
    write(folder / "robot.toml", robot_text(trial.robot, trial.experiments))


def _log(robot: DrawnRobot, experiment: Experiment, q: np.ndarray, u: np.ndarray,
         other: np.ndarray | None) -> str:
    """Text of a log; positions of motors beside those of links are angles of the motors."""
    signals = {"q": q, "u": u, "qd": experiment.q_d, "pe": experiment.pe}
    if other is not None:
        link, motor = (other, q) if robot.encoder_on_motor else (q, other)
        signals |= {"q": link, "q_motor": robot.ratio * motor}
    head = ["time"] + [f"{name}{k + 1}" for name in signals for k in range(robot.n)]
    time = robot.period * np.arange(len(q))[:, None]
    rows = np.hstack([time, *signals.values()]).round(12) + 0.0
    return "\n".join([",".join(head), *(",".join(f"{x:.10g}" for x in row) for row in rows), ""])


def robot_text(robot: DrawnRobot, experiments: Sequence[Experiment]) -> str:
    """Return the text of ``robot.toml``: the robot as stated, and its experiments."""
    parts = [_HEAD.format(
        name=_NAMES[robot.kind], n=robot.n, ratio=_list(robot.ratio), rotor=_list(robot.rotor),
        drag=_list(robot.drag), one=_list(np.ones(robot.n)), peak=_list(5.0 * robot.kp),
        offset=_list(0.01 * robot.kp))]
    if robot.links is not None:
        parts.append(_MODEL.format(file=robot.links.file, tip=TOOL, tolerance=MASS_TOLERANCE))
    elif robot.kind not in LINKS_UNSTATED:
        parts.append(_LINKS.format(
            length=_list(robot.length), mass=_list(robot.mass), com=_list(robot.com),
            inertia=_list(robot.inertia), bearing=_list(robot.bearing)))
    parts.append(_LAW.format(
        gravity=str(robot.gravity).lower(), coupling=str(robot.coupling).lower(), g=G,
        kp=_list(robot.kp), kd=_list(robot.kd), high=robot.corners[0], low=robot.corners[1],
        discretisation=robot.discretisation,
        period=robot.period, step=_list(robot.command_step), shaft=robot.shaft,
        mounting="motor side" if robot.encoder_on_motor else "joint side",
        resolution=f"{robot.resolution[0]:.10g}"))
    parts += [_EXPERIMENT.format(
        j=j + 1, excitation=one.excitation, start=_list(one.start), pose=_list(robot.pose),
        duration=round(len(one.q_d) * robot.period, 6)) for j, one in enumerate(experiments)]
    return "\n".join(parts)


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.10g}" for value in values) + "]"


_HEAD = """name = "{name}"
joints = {n}

[motor]                    # datasheet, motor side; list entry k is joint k
gear_ratio = {ratio}
inertia_kgm2 = {rotor}
viscous_friction_nms = {drag}
torque_gain = {one}        # delivered torque per commanded torque
peak_torque_nm = {peak}
inertia_tolerance = 0.01   # relative
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = {offset}   # constant offset of the drive
"""
_LINKS = """[links]                    # CAD; com along the link; inertia about the com
length_m = {length}
mass_kg = {mass}
com_m = {com}
inertia_kgm2 = {inertia}
joint_viscous_friction_nms = {bearing}   # bearings, joint side
"""
_MODEL = """[links]
model = "{file}"
tip = "{tip}"
mass_tolerance = {tolerance}      # relative, of every link
"""
_LAW = """[nominal]                  # what the nominal model contains, besides A, B and D
gravity = {gravity}
coupling = {coupling}
g = {g}

[controller]               # u = Kp (qd - q) - Kd v + pe, v = G1 q, motor side N m
Kp = {kp}
Kd = {kd}
velocity_filter_highpass_rad_s = {high}
velocity_filter_lowpass_rad_s = {low}
velocity_filter_discretisation = "{discretisation}"   # at rest before the first sample
sample_time_s = {period}
hold = "zero-order"        # the command acts from its own sample instant on
command_resolution_nm = {step}

[encoder]
mounting = "{mounting}"
shaft_ratio = {shaft}
resolution_rad = {resolution}
"""
_EXPERIMENT = """[experiment.log-{j}]
excitation = "{excitation}"
start_rad = {start}     # at rest, brake released at time 0
set_point_rad = {pose}      # centre of the motion
duration_s = {duration}
"""
