"""Torque per command from the links: a robot of known gains whose owner does not know them."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.torque_by_links import TOLERANCE, torque_by_links
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal
from clie_blocks.errors import RecordError
from clie_blocks.robot_loop.links import bias_torque, inertial_torque, planar_links

PERIOD = 2e-3
TIME = PERIOD * np.arange(15_000)
RATIO, TORQUE = np.array([40.0, 25.0]), np.array([0.3, 0.05])  # N m per unit at the motor
ROTOR, DRAG, DRY = np.array([3e-3, 1e-3]), np.array([0.02, 0.01]), np.array([0.03, 0.0])
LINKS = {"length": [0.3, 0.25], "mass": [1.2, 0.7], "com": [0.15, 0.12],
         "inertia": [0.01, 0.004]}


def motion(sizes=(0.6, 0.5)):
    """Positions of two joints and their derivatives, (N, 2) each."""
    turns = 2 * np.pi * np.array([[0.31, 0.83, 1.3], [0.23, 0.71, 1.1]])
    phase = turns[..., None] * TIME
    each = np.array(sizes)[:, None, None] / np.arange(1.0, 4.0)[None, :, None]
    return tuple((each * factor * curve(phase)).sum(axis=1).T for factor, curve in (
        (1.0, np.sin), (turns[..., None], np.cos), (-turns[..., None] ** 2, np.sin)))


def logged(gravity, sizes=(0.6, 0.5), noise=0.0):
    """Robot and log: what the motion takes, in units of the command."""
    q, dq, ddq = motion(sizes)
    links = planar_links(*LINKS.values(), has_gravity=gravity, has_coupling=True)
    torque = ((inertial_torque(links, q, ddq) + bias_torque(links, q, dq)) / RATIO + ROTOR * ddq
              + DRAG * dq + DRY * np.sign(dq))
    robot = Robot(n=2, motor=Motor(gear_ratio=RATIO), links=Links(**LINKS),
                  nominal=Nominal(gravity=gravity, coupling=True),
                  controller=Controller(law="unknown"))
    q = q + noise * np.random.default_rng(1).standard_normal(q.shape)
    u = torque / TORQUE
    return robot, Record(time=TIME, q=q, u=u, qd=q + u, robot=robot, units={"u": "%"})


@pytest.mark.parametrize("gravity", [True, False])
def test_coupling_or_weight_show_the_torque_per_command(gravity):
    robot, record = logged(gravity, noise=1e-4)
    np.testing.assert_allclose(torque_by_links(robot, [record]), TORQUE, rtol=0.02)


def test_the_command_of_a_problem_is_then_a_torque_with_a_tolerance():
    robot, record = logged(True)
    problem = Problem.from_logs(robot, [record], trust_logs=True)
    assert problem.records[0].units["u"] == ("N m", "N m")
    np.testing.assert_allclose(problem.logs[0].u, TORQUE * record.u, rtol=0.02)
    assert problem.nominal.torque_tolerance == TOLERANCE
    assert "by the links of the robot file, within 50 %" in problem.records[0].decisions[-1]


def test_the_position_error_of_a_servo_is_one_too():
    robot, record = logged(True)
    servo = record.replace(u=None)
    problem = Problem.from_logs(robot, [servo], trust_logs=True)
    np.testing.assert_allclose(problem.law.kp, TORQUE, rtol=0.02)
    assert problem.links.has_gravity and problem.links.has_coupling


def test_joints_whose_links_take_nothing_are_driven_as_the_others():
    robot, record = logged(False)
    weightless = dataclasses.replace(robot, links=Links(**{
        **LINKS, "mass": [1.2, 1e-5], "inertia": [0.01, 1e-9]}), nominal=Nominal(
            gravity=True, coupling=True))
    links = planar_links(LINKS["length"], [1.2, 1e-5], LINKS["com"], [0.01, 1e-9],
                         has_gravity=True, has_coupling=True)
    q, dq, ddq = motion()
    torque = ((inertial_torque(links, q, ddq) + bias_torque(links, q, dq)) / RATIO + ROTOR * ddq
              + DRAG * dq)
    rng = np.random.default_rng(2)
    u = (torque + 1e-3 * rng.standard_normal(q.shape)) / TORQUE
    found = torque_by_links(weightless, [record.replace(u=u)])
    np.testing.assert_allclose(found, TORQUE[0], rtol=0.05)


def test_links_that_show_nothing_leave_the_datasheet_out_or_stop():
    robot, record = logged(False, sizes=(0.0, 0.6))
    rng = np.random.default_rng(3)
    noise = record.replace(u=rng.standard_normal(record.q.shape))
    assert torque_by_links(robot, [noise]) is None
    bare = Problem.from_logs(robot, [noise], trust_logs=True)
    assert not bare.links.known and bare.nominal.torque_tolerance == 0.0
    heavy = dataclasses.replace(robot, nominal=Nominal(gravity=True, coupling=True))
    still = noise.replace(q=1e-9 * rng.standard_normal(record.q.shape))
    with pytest.raises(RecordError, match="state .motor. torque_gain"):
        Problem.from_logs(heavy, [still.replace(robot=heavy)], trust_logs=True)


def test_a_robot_without_links_shows_nothing():
    robot, record = logged(True)
    assert torque_by_links(dataclasses.replace(robot, links=Links()), [record]) is None
