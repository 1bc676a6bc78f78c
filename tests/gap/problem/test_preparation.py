"""Logs of servos and torque-driven machines in the form that the diagnosis reads."""

import dataclasses
import re

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.position_path import servo_response
from clie_blocks.analysis.gap.problem.preparation import on_even_clock, prepare
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal
from clie_blocks.errors import NotIdentifiableError, RecordError

TIME = 0.005 * np.arange(4000)
UNKNOWN = Controller(law="unknown")
PD = Controller(law="pd", kp=[1.0], kd=[1.0], sample_time=0.005)


def motion(inertia, damping):
    """A motion and its torque, exact."""
    omega = 2 * np.pi * np.array([0.3, 0.7, 1.1])
    phase = np.outer(TIME, omega)
    dq, ddq = (omega * np.cos(phase)).sum(1), -(omega**2 * np.sin(phase)).sum(1)
    return np.sin(phase).sum(1)[:, None], (inertia * ddq + damping * dq)[:, None]


def test_a_stated_robot_is_left_alone(case):
    made = case("none")
    robot, records = prepare(made.robot, made.records)
    assert robot is made.robot
    assert all(after is before for after, before in zip(records, made.records, strict=True))


def test_a_command_without_a_law_is_excitation():
    q, u = motion(0.4, 0.9)
    robot = Robot(n=1, motor=Motor(inertia=[0.4]),
                  controller=Controller(law="unknown", sample_time=0.005))
    ready, (record,) = prepare(robot, [Record(time=TIME, q=q, u=u, robot=robot)])
    assert ready.controller.law == "pd" and not ready.controller.kp.any()
    assert ready.motor.viscous_friction[0] > 0.0
    np.testing.assert_array_equal(record.pe, u)


def test_duty_becomes_the_torque_of_the_stalled_motor():
    q, u = motion(0.002, 0.01)
    robot = Robot(
        n=1, motor=Motor(torque_constant=[0.4], resistance=[4.0], inertia=[0.002]),
        links=Links(mass=[0.5], length=[0.1], com=[0.1], inertia=[0.0]),
        controller=Controller(law="servo", kp=[2.0], saturation=[1.0], supply=7.5,
                              sample_time=0.005))
    ready, (record,) = prepare(robot, [Record(time=TIME, q=q, qd=q, u=u, robot=robot)])
    np.testing.assert_allclose(record.u, 0.75 * u)
    assert ready.controller.kp[0] == pytest.approx(1.5)
    assert ready.controller.saturation[0] == pytest.approx(0.75)
    assert ready.nominal.gravity
    np.testing.assert_allclose(record.q, q - np.pi / 2)


def test_without_a_command_the_position_error_stands_for_it():
    q, _ = motion(1.0, 1.0)
    robot = Robot(n=1, controller=Controller(law="unknown", sample_time=0.005))
    ready, (record,) = prepare(robot, [Record(time=TIME, q=q, qd=q + 0.1, robot=robot)])
    np.testing.assert_allclose(record.u, 0.1)
    assert ready.controller.kp[0] == 1.0 and "position error" in record.decisions[-1]
    with pytest.raises(NotIdentifiableError, match="neither"):
        prepare(robot, [Record(time=TIME, q=q, robot=robot)])


def test_samples_of_an_unknown_controller_are_brought_to_an_even_clock():
    q, _ = motion(1.0, 1.0)
    jitter = np.random.default_rng(0).uniform(-1e-3, 1e-3, TIME.size)
    record = on_even_clock(
        Record(time=TIME + jitter, q=np.interp(TIME + jitter, TIME, q[:, 0])[:, None]), UNKNOWN)
    assert np.std(np.diff(record.time)) < 1e-9
    inside = (record.time > 1) & (record.time < 18)
    np.testing.assert_allclose(record.q[inside, 0],
                               np.interp(record.time[inside], TIME, q[:, 0]), atol=5e-3)
    whole = dataclasses.replace(record)
    assert on_even_clock(whole, UNKNOWN) is whole


def test_samples_of_a_known_controller_stay_as_they_are_whatever_their_stamps():
    q, u = motion(1.0, 1.0)
    jitter = np.random.default_rng(0).normal(0.0, 0.1 * 0.005, TIME.size)
    record = on_even_clock(Record(time=TIME + jitter, q=q, u=u, qd=q, pe=u), PD)
    np.testing.assert_array_equal(record.q, q)
    np.testing.assert_array_equal(record.u, u)
    assert record.valid.all() and len(record.segments) == 1
    assert record.sample_time == pytest.approx(0.005, rel=0.01)


def test_a_coarse_clock_is_rebuilt_rather_than_refused():
    q, u = motion(1.0, 1.0)
    ticks = 0.0156 * np.floor(TIME / 0.0156)
    record = on_even_clock(Record(time=ticks, q=q, u=u), UNKNOWN)
    np.testing.assert_array_equal(record.q, q)
    assert np.std(np.diff(record.time)) < 1e-9
    assert record.sample_time == pytest.approx(0.005, rel=1e-3)


def test_logs_of_two_robots_are_not_mixed(case):
    made = case("none")
    other = dataclasses.replace(made.robot, name="another")
    with pytest.raises(RecordError, match="different robots"):
        prepare(made.robot, [made.records[0], made.records[1].replace(robot=other)])


def test_the_delay_of_a_servo_is_noted_where_the_position_error_stands_for_the_command():
    set_point = np.repeat(np.random.default_rng(5).uniform(-0.5, 0.5, 25), 40)
    q = servo_response(set_point, set_point[0], 0.02, 25.0, 1.2, 0.0, 0.03, 0.01)
    robot = Robot(n=2, controller=Controller(law="unknown", sample_time=0.02))
    record = Record(time=0.02 * np.arange(1000), q=np.stack([q, 0 * q], 1),
                    qd=np.stack([set_point, 0 * set_point], 1), robot=robot)
    decision = prepare(robot, [record])[1][0].decisions[-1]
    assert re.search(r"joint1: the delay of the set-points is 30 \+- \S+ ms, and dry friction "
                     r"holds up to 10 \+-", decision)
    assert "joint2:" not in decision


def test_an_unlogged_reference_is_read_from_the_command(case):
    made = case("none")
    logged = [record.replace(qd=None) for record in made.records]
    records = prepare(made.robot, logged)[1]
    kp = made.robot.controller.kp
    for before, after in zip(made.records, records, strict=True):
        driven = before.pe + kp * (before.qd - before.q[0])
        moved = np.ptp(before.qd, axis=0) > 0
        error = np.abs(after.pe - driven)
        assert error[:, moved].max(initial=0.0) <= 0.51 * np.max(
            made.robot.controller.command_resolution)
        if not moved.any():
            assert np.ptp(after.pe - before.pe, axis=0).max() < 1e-12
        assert after.qd is None


def test_a_law_that_did_not_run_is_not_mistaken_for_a_reference(case):
    made = case("none")
    robot = dataclasses.replace(made.robot, controller=dataclasses.replace(
        made.robot.controller, kd=0.8 * made.robot.controller.kd))
    at_rest = [record.replace(qd=None) for record in made.records
               if not np.ptp(record.qd, axis=0).any()]
    assert at_rest
    for before, after in zip(at_rest, prepare(robot, at_rest)[1], strict=True):
        assert np.ptp(after.pe - before.pe, axis=0).max() < 1e-12


def test_a_file_that_says_whether_links_have_weight_is_believed():
    q, u = motion(0.002, 0.01)
    links = Links(mass=[0.5], length=[0.1], com=[0.1], inertia=[0.0])
    for gravity, turn in ((None, np.pi / 2), (False, 0.0), (True, 0.0)):
        robot = Robot(n=1, links=links, nominal=Nominal(gravity=gravity), controller=Controller(
            law="unknown", sample_time=0.005))
        ready, (record,) = prepare(robot, [Record(time=TIME, q=q, u=u, robot=robot)])
        assert bool(ready.nominal.gravity) == (gravity is not False)
        np.testing.assert_allclose(record.q, q - turn)


def test_a_measured_torque_drives_the_model_where_nothing_else_was_logged():
    q, u = motion(0.002, 0.01)
    robot = Robot(n=1, controller=Controller(law="unknown", sample_time=0.005))
    ready, (record,) = prepare(robot, [Record(time=TIME, q=q, tau=u, robot=robot)])
    np.testing.assert_array_equal(record.pe, u)
    assert ready.controller.u_is == "measured"
    assert "measured torque drives the model" in " ".join(record.decisions)
