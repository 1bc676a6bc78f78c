"""Small robots that several tests share, simulated by code that the diagnosis does not use."""

import functools

import numpy as np
import pytest

from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.problem.problem import Problem

ROBOT = """joints = {n}
[motor]
gear_ratio = {ratio}
inertia_kgm2 = {inertia}
viscous_friction_nms = {friction}
inertia_tolerance = 0.01
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = {offset}
[nominal]
gravity = {gravity}
[links]
length_m = {length}
mass_kg = {mass}
com_m = {length}
inertia_kgm2 = [0.0]
joint_viscous_friction_nms = [0.0]
[controller]
Kp = {kp}
Kd = {kd}
velocity_filter_highpass_rad_s = 200.0
velocity_filter_lowpass_rad_s = 300.0
velocity_filter_discretisation = "tustin"
sample_time_s = 0.001
command_resolution_nm = {resolution}
[encoder]
resolution_rad = {lsb}
"""


@functools.cache
def made(name, seed):
    """Robot with one effect, or ``none``; 6 s per log."""
    kind = "none" if name == "none" else "single"
    return draw_cases(1, seed, [name] if kind == "single" else ["coulomb"], [kind], duration=6.0)[
        0
    ]


@pytest.fixture(scope="session")
def case():
    """Function from an effect's name to a robot that has it."""
    return lambda name, seed=3: made(name, seed)


@pytest.fixture(scope="session")
def healthy(case):
    """Problem of a healthy robot."""
    robot = case("none")
    return Problem.from_logs(robot.robot, robot.records)


def in_a_folder(made, at):
    """Write a robot and its logs as a trial."""
    from clie_blocks.analysis.records import write_record

    at.mkdir()
    robot = made.robot
    links = robot.links.mass is not None
    text = ROBOT.format(
        n=robot.n, ratio=list(robot.motor.gear_ratio), inertia=list(robot.motor.inertia),
        friction=list(robot.motor.viscous_friction), gravity=str(links).lower(),
        offset=list(robot.motor.torque_offset_tolerance), kp=list(robot.controller.kp),
        length=list(robot.links.length) if links else [0.0], kd=list(robot.controller.kd),
        mass=list(robot.links.mass) if links else [0.0], lsb=list(robot.encoder.resolution),
        resolution=list(robot.controller.command_resolution)).replace("np.float64", "")
    (at / "robot.toml").write_text(text.replace("(", "").replace(")", ""))
    for k, record in enumerate(made.records):
        write_record(record, at / f"log-{k + 1}.csv")


@pytest.fixture(scope="session")
def write_trial():
    """Function that writes a simulated robot and its logs into a new folder."""
    return in_a_folder


@pytest.fixture(scope="module")
def engine_arm(tmp_path_factory):
    """Function that runs a drawn arm in MuJoCo: robot as its file says, and two records."""
    pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    from clie_blocks.analysis.blind.engine.control_loop import run
    from clie_blocks.analysis.blind.engine.experiments import Experiment, draw_experiments
    from clie_blocks.analysis.blind.population.files import robot_text
    from clie_blocks.analysis.records import Record, read_robot

    def simulated(rng, body, truth, rows):
        motions = [Experiment(m.excitation, m.start, m.q_d[:rows], m.pe[:rows])
                   for m in draw_experiments(rng, body)[:2]]
        runs = run(body, [truth] * 2, motions, [body.sigma * rng.standard_normal(m.q_d.shape)
                                                for m in motions])
        file = tmp_path_factory.mktemp("arm") / "robot.toml"
        file.write_text(robot_text(body, motions))
        return read_robot(file), [
            Record(time=body.period * np.arange(len(q)), q=q, u=u, qd=m.q_d, pe=m.pe,
                   source=f"log-{j + 1}") for j, (m, (q, u)) in enumerate(zip(motions, runs))]

    return simulated
