"""The engine against closed forms: what each of its parts does to the experiment."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.parameters import G
from clie_blocks.analysis.blind.engine.robot import link_inertia

FIRST = np.array([1.0, 0.0, 0.0])


def test_dry_friction_holds_what_is_weaker_and_yields_to_what_is_stronger(quiet_robot):
    joint = quiet_robot()
    torque = 0.01 * joint.robot.kp
    held, _ = joint.run(joint.experiment(torque=torque), level=1.2 * torque)
    free, _ = joint.run(joint.experiment(torque=torque), level=0.5 * torque)
    assert np.ptp(held) < 1e-5 < 1e-3 < np.ptp(free)


def test_a_payload_sags_by_its_weight_over_the_stiffness(quiet_robot):
    joint = quiet_robot(gravity=True)
    robot, experiment = joint.robot, joint.experiment(6.0)
    with_mass, without = (joint.run(experiment, payload=mass)[0][-1, 0] for mass in (1e-3, 0.0))
    weight = 1e-3 * G * robot.length[0] * np.cos(without)
    gravity = -robot.mass[0] * G * robot.com[0] * np.sin(without)  # stiffness of the link itself
    sag = weight / (robot.kp[0] * robot.ratio[0] + gravity)
    assert without - with_mass == pytest.approx(sag, rel=0.02)


def test_a_tilted_mount_lets_part_of_the_weight_through(quiet_robot):
    joint = quiet_robot()
    robot = joint.robot
    tilted, level = (joint.run(joint.experiment(6.0), tilt=tilt)[0][-1, 0] for tilt in (0.01, 0.0))
    weight = robot.mass[0] * G * np.sin(0.01) * robot.com[0] * np.cos(tilted)
    assert level == pytest.approx(robot.pose[0], abs=1e-9)
    assert level - tilted == pytest.approx(weight / (robot.kp[0] * robot.ratio[0]), rel=1e-3)


def test_an_elastic_gear_rings_at_the_frequency_of_two_masses_on_its_spring(quiet_robot):
    joint = quiet_robot()
    robot, p = joint.robot, joint.truth
    link = robot.mass * robot.com**2 + robot.inertia
    motor = p["rotor"] * robot.ratio**2
    stiffness = (2 * np.pi * 20) ** 2 / (1 / link + 1 / motor)
    experiment = joint.experiment(2.0, torque=0.1 * robot.kp)
    (q, _), (rigid, _) = (joint.run(experiment, twist_stiffness=k) for k in (stiffness, 0.0))
    ringing = np.diff(q - rigid, 2, axis=0)[:, 0]
    spectrum = np.abs(np.fft.rfft(ringing))
    assert np.fft.rfftfreq(len(ringing), 1e-3)[spectrum.argmax()] == pytest.approx(20, abs=1)


def test_a_gap_leaves_the_link_behind_by_at_most_its_width(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(1.0, torque=0.05 * joint.robot.kp)
    (loose, _), (tight, _) = (joint.run(experiment, half_gap=gap) for gap in (2e-3, 0.0))
    assert 5e-4 < np.max(np.abs(loose - tight)) < 6e-3


@pytest.mark.parametrize("numbers", [{"delay": 0.01}, {"late": 0.01}, {"lag": 0.01}])
def test_a_late_drive_starts_late(quiet_robot, numbers):
    joint = quiet_robot()
    experiment = joint.experiment(0.2, torque=0.1 * joint.robot.kp)
    (late, _), (prompt, _) = joint.run(experiment, **numbers), joint.run(experiment)
    shift = np.interp(prompt[100, 0], late[:, 0], np.arange(len(late))) - 100
    assert 5 < shift < 12


def test_a_lag_that_is_too_short_for_the_engine_is_left_out(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(0.1, torque=0.1 * joint.robot.kp)
    assert np.array_equal(joint.run(experiment, lag=1e-4)[0], joint.run(experiment)[0])


def test_a_limited_drive_accelerates_with_its_limit(quiet_robot):
    joint = quiet_robot()
    limit = 0.02 * joint.robot.kp[0]
    experiment = joint.experiment(0.05, torque=0.5 * joint.robot.kp)
    (limited, _), (small, _) = (joint.run(experiment, limit=limit),
                                joint.run(joint.experiment(0.05, torque=limit)))
    assert limited == pytest.approx(small, abs=2e-3 * np.ptp(limited) + 1e-7, rel=0.2)


def test_load_dependent_friction_needs_a_load(quiet_robot):
    for gravity in (True, False):
        joint = quiet_robot(gravity=gravity)
        experiment = joint.experiment(1.0, torque=0.3 * joint.robot.kp)
        (rubbing, _), (free, _) = joint.run(experiment, slope=0.1), joint.run(experiment)
        assert (np.max(np.abs(rubbing - free)) > 1e-4) == gravity


def test_bristles_of_the_motor_are_a_spring_for_small_torques(quiet_robot):
    joint = quiet_robot()
    joint.robot = dataclasses.replace(joint.robot, kd=0 * joint.robot.kd)
    torque = 0.01 * joint.robot.kp
    experiment = joint.experiment(0.2, torque=torque)
    q, _ = joint.run(experiment, bristle=100 * torque, bristle_range=4e-3)
    spring = torque[0] / (joint.robot.kp[0] + 100 * torque[0] / 4e-3)
    assert (q - q[0]).max() == pytest.approx(2 * spring, rel=0.05)  # the first swing


def test_bristles_of_the_motor_yield_to_large_torques(quiet_robot):
    joint = quiet_robot()
    torque = 0.01 * joint.robot.kp
    experiment = joint.experiment(3.0, torque=torque)
    (held, _), (free, _) = (joint.run(experiment, bristle=share * torque, bristle_range=4e-3)
                            for share in (0.3, 0.0))
    assert (held[-1] - held[0]) == pytest.approx(0.7 * (free[-1] - free[0]), rel=0.1)


def test_cogging_of_the_motor_bends_a_slow_motion_as_often_as_it_has_poles(quiet_robot):
    joint = quiet_robot()
    robot = joint.robot
    experiment = joint.experiment(4.0)
    turn = 2 * np.pi / (9 * robot.ratio[0])  # one period of the ripple, at the joint
    slow = robot.pose + np.linspace(0.0, 6 * turn, len(experiment.q_d))[:, None]
    experiment = dataclasses.replace(experiment, q_d=slow)
    (bent, _), (straight, _) = (joint.run(experiment, ripple=level * robot.kp, poles=9.0)
                                for level in (1e-4, 0.0))
    late = slice(len(slow) // 3, None)
    wave = (bent - straight)[late, 0]
    spectrum = np.abs(np.fft.rfft(wave - wave.mean()))
    assert spectrum.argmax() == 4  # two thirds of six periods


def test_a_hard_stop_ends_the_travel(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(1.0, torque=0.2 * joint.robot.kp)
    q, _ = joint.run(experiment, hard_stop=joint.robot.pose + 0.05)
    free, _ = joint.run(experiment)
    assert free.max() - joint.robot.pose[0] > 0.1
    assert q.max() - joint.robot.pose[0] == pytest.approx(0.05, abs=0.01)


def test_a_wall_ends_the_way_of_the_tip(quiet_robot):
    joint = quiet_robot()
    robot = joint.robot
    experiment = joint.experiment(1.0, torque=0.2 * robot.kp)
    q, _ = joint.run(experiment, wall=0.05 * robot.length.sum())
    assert np.sin(q.max() - robot.pose[0]) == pytest.approx(0.05, abs=0.01)


def test_links_that_are_not_coupled_move_as_joints_side_by_side(quiet_robot):
    arm = quiet_robot("arm", seed=5)
    assert arm.robot.n > 1
    one = arm.experiment(1.0)
    torque = 0.2 * arm.robot.kp * (np.arange(arm.robot.n) == 0)
    experiment = dataclasses.replace(one, pe=np.broadcast_to(torque, one.q_d.shape))
    (apart, _), (coupled, _) = (arm.run(experiment, links=share) for share in (0.0, 1.0))
    apart, coupled = np.ptp(apart, axis=0), np.ptp(coupled, axis=0)
    assert apart[0] > 0.02 and np.all(apart[1:] == 0.0) and np.all(coupled[1:] > 1e-3)


def test_a_late_encoder_moves_the_robot_as_a_late_drive_does(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(1.0, torque=0.2 * joint.robot.kp)
    (seen, _), (driven, _), (prompt, _) = (
        joint.run(experiment, **{key: 0.006}) for key in ("late", "delay", "tone"))
    assert np.max(np.abs(seen - driven)) < 5e-3 * np.max(np.abs(driven - prompt))


def test_a_warm_motor_loses_torque_with_the_square_of_its_command(quiet_robot):
    joint = quiet_robot(gravity=True)
    experiment = joint.experiment(8.0)
    cold, u = joint.run(experiment)
    warm, more = joint.run(experiment, heating=0.2 / u[-1] ** 2, heating_time=0.5)
    weight = np.cos(warm[-1]) / np.cos(cold[-1])
    weaker = u[-1] * weight / more[-1]  # share of the command that holds the link
    lost = 0.2 * weaker * (more[-1] / u[-1]) ** 2  # a warm winding takes less power
    assert weaker == pytest.approx(1 / (1 + lost), rel=1e-3)
    assert weaker < 0.9


@pytest.mark.parametrize("lift", [0.0, 0.8, np.pi / 2])
def test_the_vertical_axis_turns_the_rotors_and_what_its_links_reach(quiet_robot, lift):
    joint = quiet_robot("spatial", seed=32)
    robot = joint.robot
    pose = np.array([0.4, lift, 0.0])
    link = link_inertia("spatial", robot.length, robot.mass, robot.com, robot.inertia, pose)
    turned = robot.rotor * robot.ratio**2 - robot.link + link
    torque = 0.2 * robot.kp * FIRST
    experiment = joint.experiment(0.01, torque=torque)
    still = np.tile(pose, (len(experiment.q_d), 1))
    experiment = dataclasses.replace(experiment, start=pose, q_d=still)
    q, u = joint.run(experiment, drag=0.0)
    t = robot.period * (len(q) - 1)
    expected = 0.5 * (torque * robot.ratio / turned)[0] * t**2
    assert q[-1, 0] - pose[0] == pytest.approx(expected, rel=0.08)
