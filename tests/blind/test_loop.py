"""The loop against closed forms: what each number does to the motion."""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete, lfilter

from clie_blocks.analysis.blind.engine.controller import filter_coefficients
from clie_blocks.analysis.blind.engine.robot import G


def test_a_healthy_joint_moves_as_the_exact_solution_of_its_equation(bench):
    joint = bench()
    robot = joint.robot
    motion = joint.motion(2.0, torque=0.1 * robot.kp)
    q, u = joint.run(motion)
    assert q == pytest.approx(_exact(joint, u), abs=2e-8)
    assert np.ptp(q) > 0.05


def _exact(joint, u):
    """Angle under held commands, by matrix exponential."""
    robot, p = joint.robot, joint.truth
    ratio = robot.ratio[0]
    inertia = p["rotor"][0] * ratio**2 + robot.mass[0] * robot.com[0]**2 + robot.inertia[0]
    damping = p["drag"][0] * ratio**2 + robot.bearing[0]
    matrix = np.array([[0, 1, 0], [0, -damping / inertia, ratio / inertia], [0, 0, 0]])
    step, state, found = expm(robot.period * matrix), np.zeros(2), []
    for torque in u[:, 0]:
        found.append(robot.pose[0] + state[0])
        state = (step @ [*state, torque])[:2]
    return np.array(found)[:, None]


@pytest.mark.parametrize("discretisation", ["tustin", "zoh", "backward", "matched"])
def test_the_command_follows_from_the_measured_angle_by_the_stated_law(bench, discretisation):
    joint = bench("arm", seed=5)
    robot = dataclasses.replace(joint.robot, command_step=1e-3 * joint.robot.kp,
                                discretisation=discretisation)
    joint.robot = robot
    motion = joint.motion(0.8, torque=0.2 * robot.kp, angle=0.1)
    q, u = joint.run(motion)
    numerator, denominator = _velocity_filter(robot)
    speed = lfilter(numerator, denominator, q - q[0], axis=0)
    stated = robot.kp * (motion.q_d - q) - robot.kd * speed + motion.pe
    assert np.max(np.abs(u - stated) / robot.command_step) < 0.501


def _velocity_filter(robot):
    """G1 by the textbook's way of each discretisation."""
    high, low, period = *robot.corners, robot.period
    if robot.discretisation == "matched":
        denominator = np.poly(np.exp([-high * period, -low * period]))
        return np.array([1.0, -1.0]) * denominator.sum() / period, denominator
    method = {"backward": "backward_diff"}.get(robot.discretisation, robot.discretisation)
    numerator, denominator, _ = cont2discrete(
        ([high * low, 0], [1, high + low, high * low]), period, method)
    return numerator.ravel(), denominator


@pytest.mark.parametrize("discretisation", ["tustin", "zoh", "backward", "matched"])
def test_every_velocity_filter_gives_the_slope_of_a_ramp(discretisation):
    b, a = filter_coefficients(np.array(150.0), np.array(300.0), 1e-3, discretisation)
    speed = lfilter(b, a, 0.7e-3 * np.arange(400))
    held = 5e-3 if discretisation == "zoh" else 1e-6  # a ramp in steps
    assert speed[-1] == pytest.approx(0.7, rel=held)


def test_dry_friction_holds_what_is_weaker_and_yields_to_what_is_stronger(bench):
    joint = bench()
    torque = 0.01 * joint.robot.kp
    held, _ = joint.run(joint.motion(torque=torque), level=1.2 * torque)
    free, _ = joint.run(joint.motion(torque=torque), level=0.5 * torque)
    assert np.ptp(held) < 1e-5 < 1e-3 < np.ptp(free)


def test_a_payload_sags_by_its_weight_over_the_stiffness(bench):
    joint = bench(gravity=True)
    robot, motion = joint.robot, joint.motion(6.0)
    with_mass, without = (joint.run(motion, payload=mass)[0][-1, 0] for mass in (1e-3, 0.0))
    weight = 1e-3 * G * robot.length[0] * np.cos(without)
    gravity = -robot.mass[0] * G * robot.com[0] * np.sin(without)  # stiffness of the link itself
    sag = weight / (robot.kp[0] * robot.ratio[0] + gravity)
    assert without - with_mass == pytest.approx(sag, rel=0.02)


def test_a_tilted_mount_lets_part_of_the_weight_through(bench):
    joint = bench()
    robot = joint.robot
    tilted, level = (joint.run(joint.motion(6.0), tilt=tilt)[0][-1, 0] for tilt in (0.01, 0.0))
    weight = robot.mass[0] * G * np.sin(0.01) * robot.com[0] * np.cos(tilted)
    assert level == pytest.approx(robot.pose[0], abs=1e-9)
    assert level - tilted == pytest.approx(weight / (robot.kp[0] * robot.ratio[0]), rel=1e-3)


def test_an_elastic_gear_rings_at_the_frequency_of_two_masses_on_its_spring(bench):
    joint = bench()
    robot, p = joint.robot, joint.truth
    link = robot.mass * robot.com**2 + robot.inertia
    motor = p["rotor"] * robot.ratio**2
    stiffness = (2 * np.pi * 20) ** 2 / (1 / link + 1 / motor)
    motion = joint.motion(2.0, torque=0.1 * robot.kp)
    (q, _), (rigid, _) = (joint.run(motion, twist_stiffness=k) for k in (stiffness, 0.0))
    ringing = np.diff(q - rigid, 2, axis=0)[:, 0]
    spectrum = np.abs(np.fft.rfft(ringing))
    assert np.fft.rfftfreq(len(ringing), 1e-3)[spectrum.argmax()] == pytest.approx(20, abs=1)


def test_a_gap_leaves_the_link_behind_by_at_most_its_width(bench):
    joint = bench()
    motion = joint.motion(1.0, torque=0.05 * joint.robot.kp)
    (loose, _), (tight, _) = (joint.run(motion, half_gap=gap) for gap in (2e-3, 0.0))
    assert 5e-4 < np.max(np.abs(loose - tight)) < 6e-3


@pytest.mark.parametrize("numbers", [{"delay": 0.01}, {"late": 0.01}, {"lag": 0.01}])
def test_a_late_drive_starts_late(bench, numbers):
    joint = bench()
    motion = joint.motion(0.2, torque=0.1 * joint.robot.kp)
    (late, _), (prompt, _) = joint.run(motion, **numbers), joint.run(motion)
    shift = np.interp(prompt[100, 0], late[:, 0], np.arange(len(late))) - 100
    assert 5 < shift < 12


def test_a_lag_that_is_too_short_for_the_engine_is_left_out(bench):
    joint = bench()
    motion = joint.motion(0.1, torque=0.1 * joint.robot.kp)
    assert np.array_equal(joint.run(motion, lag=1e-4)[0], joint.run(motion)[0])


def test_a_limited_drive_accelerates_with_its_limit(bench):
    joint = bench()
    limit = 0.02 * joint.robot.kp[0]
    motion = joint.motion(0.05, torque=0.5 * joint.robot.kp)
    (limited, _), (small, _) = (joint.run(motion, limit=limit),
                                joint.run(joint.motion(0.05, torque=limit)))
    assert limited == pytest.approx(small, abs=2e-3 * np.ptp(limited) + 1e-7, rel=0.2)


@pytest.mark.parametrize("numbers", [
    {"dead": 1e-2}, {"ripple": 1e-2, "poles": 9.0}, {"tone": 1e-2}, {"bias": 1e-2},
    {"stiffness": 5.0}, {"quadratic": 1.0}, {"bristle": 1e-2, "bristle_range": 5e-3},
    {"warm_level": 1e-2}, {"warm_drag": 0.1}, {"fault_torque": 1e-2}, {"fault_drag": 0.1},
    {"fault_level": 1e-2}, {"wavy_level": 2e-2, "waves": 8.0}, {"wavy_drag": 0.1, "waves": 8.0},
    {"wandering": 0.1}, {"random": 1e-2}, {"lost": 0.2}, {"heating": 100.0}, {"sag": 0.2},
    {"eccentric": 1e-2}, {"step": 1e-2}, {"corner": 0.5}, {"integral": 0.5}, {"kp_factor": 1.1},
    {"gain": 1.1}, {"hard_stop": 0.02}, {"wall": 2e-3}, {"stop": 0.02, "stop_stiffness": 0.1}],
    ids=lambda n: next(iter(n)))
def test_each_number_moves_the_robot_and_its_neutral_value_does_not(bench, numbers):
    joint = bench()
    scale = {key: value * joint.robot.kp if key in TORQUES else value
             for key, value in numbers.items()}
    for key in {"stop", "hard_stop"} & set(scale):
        scale[key] = scale[key] + joint.robot.pose
    motion = joint.motion(1.0, torque=0.2 * joint.robot.kp)
    healthy = joint.run(motion)[0]
    assert np.max(np.abs(joint.run(motion, **scale)[0] - healthy)) > 1e-5
    assert np.array_equal(joint.run(motion, **{key: joint.truth[key] for key in numbers})[0],
                          healthy)


TORQUES = ("dead", "ripple", "tone", "bias", "stiffness", "quadratic", "bristle", "warm_level",
           "warm_drag", "fault_torque", "fault_drag", "fault_level", "wavy_level", "wavy_drag",
           "wandering", "random", "integral", "stop_stiffness")


def test_load_dependent_friction_needs_a_load(bench):
    for gravity in (True, False):
        joint = bench(gravity=gravity)
        motion = joint.motion(1.0, torque=0.3 * joint.robot.kp)
        (rubbing, _), (free, _) = joint.run(motion, slope=0.1), joint.run(motion)
        assert (np.max(np.abs(rubbing - free)) > 1e-4) == gravity


def test_bristles_of_the_motor_are_a_spring_for_small_torques(bench):
    joint = bench()
    joint.robot = dataclasses.replace(joint.robot, kd=0 * joint.robot.kd)
    torque = 0.01 * joint.robot.kp
    q, _ = joint.run(joint.motion(0.2, torque=torque), bristle=100 * torque, bristle_range=4e-3)
    spring = torque[0] / (joint.robot.kp[0] + 100 * torque[0] / 4e-3)
    assert (q - q[0]).max() == pytest.approx(2 * spring, rel=0.05)  # the first swing


def test_bristles_of_the_motor_yield_to_large_torques(bench):
    joint = bench()
    torque = 0.01 * joint.robot.kp
    motion = joint.motion(3.0, torque=torque)
    (held, _), (free, _) = (joint.run(motion, bristle=share * torque, bristle_range=4e-3)
                            for share in (0.3, 0.0))
    assert (held[-1] - held[0]) == pytest.approx(0.7 * (free[-1] - free[0]), rel=0.1)


def test_cogging_of_the_motor_bends_a_slow_motion_as_often_as_it_has_poles(bench):
    joint = bench()
    robot = joint.robot
    motion = joint.motion(4.0)
    turn = 2 * np.pi / (9 * robot.ratio[0])  # one period of the ripple, at the joint
    slow = robot.pose + np.linspace(0.0, 6 * turn, len(motion.q_d))[:, None]
    motion = dataclasses.replace(motion, q_d=slow)
    (bent, _), (straight, _) = (joint.run(motion, ripple=level * robot.kp, poles=9.0)
                                for level in (1e-4, 0.0))
    late = slice(len(slow) // 3, None)
    wave = (bent - straight)[late, 0]
    spectrum = np.abs(np.fft.rfft(wave - wave.mean()))
    assert spectrum.argmax() == 4  # two thirds of six periods


def test_a_hard_stop_ends_the_travel(bench):
    joint = bench()
    motion = joint.motion(1.0, torque=0.2 * joint.robot.kp)
    q, _ = joint.run(motion, hard_stop=joint.robot.pose + 0.05)
    free, _ = joint.run(motion)
    assert free.max() - joint.robot.pose[0] > 0.1
    assert q.max() - joint.robot.pose[0] == pytest.approx(0.05, abs=0.01)


def test_a_wall_ends_the_way_of_the_tip(bench):
    joint = bench()
    robot = joint.robot
    motion = joint.motion(1.0, torque=0.2 * robot.kp)
    q, _ = joint.run(motion, wall=0.05 * robot.length.sum())
    assert np.sin(q.max() - robot.pose[0]) == pytest.approx(0.05, abs=0.01)


def test_links_that_are_not_coupled_move_as_joints_side_by_side(bench):
    arm = bench("arm", seed=5)
    assert arm.robot.n > 1
    one = arm.motion(1.0)
    torque = 0.2 * arm.robot.kp * (np.arange(arm.robot.n) == 0)
    motion = dataclasses.replace(one, pe=np.broadcast_to(torque, one.q_d.shape))
    (apart, _), (coupled, _) = (arm.run(motion, links=share) for share in (0.0, 1.0))
    apart, coupled = np.ptp(apart, axis=0), np.ptp(coupled, axis=0)
    assert apart[0] > 0.02 and np.all(apart[1:] == 0.0) and np.all(coupled[1:] > 1e-3)


def test_a_late_encoder_moves_the_robot_as_a_late_drive_does(bench):
    joint = bench()
    motion = joint.motion(1.0, torque=0.2 * joint.robot.kp)
    (seen, _), (driven, _), (prompt, _) = (
        joint.run(motion, **{key: 0.006}) for key in ("late", "delay", "tone"))
    assert np.max(np.abs(seen - driven)) < 5e-3 * np.max(np.abs(driven - prompt))


def test_a_warm_motor_loses_torque_with_the_square_of_its_command(bench):
    joint = bench(gravity=True)
    motion = joint.motion(8.0)
    cold, u = joint.run(motion)
    warm, more = joint.run(motion, heating=0.2 / u[-1] ** 2, heating_time=0.5)
    weight = np.cos(warm[-1]) / np.cos(cold[-1])
    weaker = u[-1] * weight / more[-1]  # share of the command that holds the link
    lost = 0.2 * weaker * (more[-1] / u[-1]) ** 2  # a warm winding takes less power
    assert weaker == pytest.approx(1 / (1 + lost), rel=1e-3)
    assert weaker < 0.9
