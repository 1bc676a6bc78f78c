"""Laws that damp a velocity which the drive measured: the law gives the commands exactly."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.measured_velocity import with_measured_velocity
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Motor

T, LAG = 2e-3, 4e-3  # s: period, and lag of the drive's velocity
TIME = T * np.arange(2000)
Q = np.stack([0.4 * np.sin(3 * TIME) ** 2, 0.3 * (1 - np.cos(5 * TIME))], axis=1)
DQ = np.stack([1.2 * np.sin(6 * TIME), 1.5 * np.sin(5 * TIME)], axis=1)
KP, KD, KI = np.array([30.0, 12.0]), np.array([1.6, 0.7]), np.array([50.0, 20.0])


def behind_a_lag(dq):
    """Velocity as the drive gives it, with noise of its own."""
    shown, pole = np.zeros_like(dq), np.exp(-T / LAG)
    for k in range(1, len(dq)):
        shown[k] = pole * shown[k - 1] + (1 - pole) * dq[k - 1]
    return shown + 1e-3 * np.random.default_rng(0).normal(size=dq.shape)


def commands(law, error, dq):
    if law == "pd":
        return KP * error - KD * dq
    if law == "pid":
        return KP * error + KI * T * np.cumsum(error, axis=0) - KD * dq
    inner = KP * error - dq
    return KD * inner + KI * T * np.cumsum(inner, axis=0)


def logged(law, velocity_filter="exact", **keys):
    """Robot and record under a law on the measured velocity."""
    ki = {} if law == "pd" else {"ki": KI}
    damping = {"kv": KD} if law == "cascade" else {"kd": KD}
    controller = Controller(law=law, kp=KP, **damping, **ki, sample_time=T,
                            velocity_filter=velocity_filter, **keys)
    robot = Robot(n=2, controller=controller,
                  motor=Motor(inertia=np.full(2, 0.05), viscous_friction=np.full(2, 0.1)))
    qd, dq = Q + 0.02 * np.sin(7 * TIME)[:, None], behind_a_lag(DQ)
    return robot, Record(time=TIME, q=Q, qd=qd, dq=dq, u=commands(law, qd - Q, dq), robot=robot)


@pytest.mark.parametrize("law", ["pd", "pid", "cascade"])
def test_the_law_gives_the_commands_and_has_the_lag_of_the_drive(law):
    problem = Problem.from_logs(*(lambda robot, record: (robot, [record]))(*logged(law)))
    log, size = problem.logs[0], np.abs(problem.logs[0].u).max()
    assert np.abs(problem.law.commands(log) - log.u).max() < 1e-9 * size
    assert any("the velocity dq that was logged, as stated" in one
               for one in problem.records[0].decisions)
    assert abs(1.0 / problem.robot.controller.highpass - LAG) < T / 2
    unexplained = np.std(log.pe, axis=0) / (KD * np.std(DQ, axis=0))
    assert np.all(unexplained < 0.02)


def test_what_the_file_does_not_say_the_commands_do():
    robot, record = logged("pd", None)
    changed, _ = with_measured_velocity(robot, [record])
    assert changed.controller.velocity_filter == "two_corner"
    robot, record = logged("pd", "difference")
    assert with_measured_velocity(robot, [record])[0] is not robot
    formed = KP * (record.qd - Q) - KD * np.diff(Q, axis=0, prepend=Q[:1]) / T
    same, records = with_measured_velocity(robot, [record.replace(u=formed)])
    assert same is robot and records[0].pe is None


@pytest.mark.parametrize("keys", [
    {"compensation": "computed_torque"}, {"command_rate": np.full(2, 1e3)},
    {"sample_time": T / 4}])
def test_a_law_whose_damping_is_not_all_that_a_velocity_does_stays_as_stated(keys):
    robot, record = logged("pd")
    controller = dataclasses.replace(robot.controller, **keys)
    robot = dataclasses.replace(robot, controller=controller)
    assert with_measured_velocity(robot, [record])[0] is robot


def test_a_log_without_the_velocity_stays_as_it_is():
    robot, record = logged("pd")
    assert with_measured_velocity(robot, [record.replace(dq=None)])[0] is robot
