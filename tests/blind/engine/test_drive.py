"""Drives: what they make of a command, by their own words."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.actuators import STEP
from clie_blocks.analysis.blind.engine.drive import Drive
from clie_blocks.analysis.blind.engine.moment import Moment

ONE = np.ones((1, 1))


def drive_of(robot, p):
    return Drive(robot, p, lambda kind: np.full((1, robot.n), 0.5))


def test_a_turning_motor_has_less_torque_to_drive_and_all_of_it_to_brake(quiet_robot, one_lane):
    drive = drive_of(quiet_robot().robot, one_lane(peak=2.0, droop=0.25))
    for u, dq, found in ((5.0, 0.0, 2.0), (5.0, 2.0, 1.0), (-5.0, 2.0, -2.0), (5.0, 6.0, 0.0),
                         (0.5, 2.0, 0.5), (-5.0, -2.0, -1.0)):
        assert drive.torque(Moment(0.0, ONE, dq * ONE, u * ONE)) == pytest.approx(found)


def test_unequal_current_sensors_ripple_twice_per_electrical_turn(quiet_robot, one_lane):
    robot = quiet_robot().robot
    drive = drive_of(robot, one_lane(phase_gain=0.1, pole_pairs=3.0))
    turn = 2 * np.pi / (3 * robot.ratio[0])
    angles = np.arange(64) / 64 * turn
    torque = np.array([drive.torque(Moment(0.0, q * ONE, ONE, 2 * ONE))[0, 0] for q in angles])
    spectrum = np.abs(np.fft.rfft(torque)) / 64
    assert spectrum[0] == pytest.approx(2)
    assert spectrum[2] == pytest.approx(0.1 / 2.1)
    assert spectrum[1:].argmax() == 1 and np.sum(spectrum[1:] > 1e-12) == 1


def test_back_emf_of_a_voltage_drive_is_viscous_drag(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(1.0, torque=0.2 * joint.robot.kp)
    brake = 0.5 * joint.truth["drag"][0]
    driven, dragged = (joint.run(experiment, **change)[0] for change in (
        {"back_emf": brake}, {"drag": joint.truth["drag"][0] + brake}))
    assert driven == pytest.approx(dragged, abs=1e-6)
    assert np.max(np.abs(driven - joint.run(experiment)[0])) > 1e-3


def test_all_motors_of_one_source_weaken_by_the_same_share(quiet_robot, one_lane):
    robot = quiet_robot("arm", seed=5).robot
    drive = drive_of(robot, one_lane(2, source_sag=0.05))
    u = np.array([[3.0, -1.0]])
    assert drive(0.0, u) == pytest.approx(u * (1 - 0.05 * 4.0 / robot.kp.mean()))


def test_a_drive_rounds_to_its_quantum_and_leaves_the_others_alone(quiet_robot, one_lane):
    p = one_lane(2)
    p["quantum"][0, 0] = 0.5
    drive = drive_of(quiet_robot("arm", seed=5).robot, p)
    assert drive(0.0, np.array([[1.3, 1.3]])) == pytest.approx(np.array([[1.5, 1.3]]))


def test_commands_of_a_second_clock_are_as_old_as_its_slip(quiet_robot, one_lane):
    robot = quiet_robot().robot
    drive = drive_of(robot, one_lane(jitter=8e-3, beat=5.0))
    for i in range(400):
        t = i * robot.period
        drive(t, i * ONE)
        age = 8e-3 * ((5.0 * t) % 1)
        since = STEP * (np.arange(40) + 0.5) / 40  # the instants of a step of the engine
        held = np.clip(i - np.ceil((age - since) / robot.period - 1e-9).clip(0), 0, None)
        torque = drive.torque(Moment(t, ONE, ONE, i * ONE))[0, 0]
        assert torque == pytest.approx(held.mean(), abs=0.5 / drive.PARTS)


def test_a_busy_bus_holds_the_command_for_its_share_of_the_time(quiet_robot, one_lane):
    drive = drive_of(quiet_robot().robot, one_lane(hold=0.04, hold_interval=0.2, phase=1.0))
    sent = np.arange(2000)
    got = np.array([drive(i * 1e-3, i * ONE)[0, 0] for i in sent])
    assert np.mean(got < sent) == pytest.approx(0.2, abs=0.01)
    assert np.max(sent - got) == pytest.approx(40, abs=1)


def test_a_torque_that_may_only_creep_follows_at_its_own_rate(quiet_robot, one_lane):
    robot = quiet_robot().robot
    drive = drive_of(robot, one_lane(torque_slew=50.0))
    got = np.array([drive(i * robot.period, (i > 0) * ONE)[0, 0] for i in range(40)])
    assert np.diff(got).max() == pytest.approx(50 * robot.period)
    assert got[0] == 0.0 and got[-1] == 1.0


def test_a_lifting_brush_loses_its_torque_for_a_moment(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(2.0, torque=0.2 * joint.robot.kp)
    lifted = joint.run(experiment, brush=0.5)[0]
    assert 1e-5 < np.max(np.abs(lifted - joint.run(experiment)[0])) < 0.1
