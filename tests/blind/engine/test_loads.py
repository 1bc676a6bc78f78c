"""Loads against potentials, powers and equilibria found by another route."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from clie_blocks.analysis.blind.engine.actuators import ANCHOR, LEVER
from clie_blocks.analysis.blind.engine.loads import (
    Detent,
    FluidDrag,
    Hose,
    Imbalance,
    NeighbourSpring,
)
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import G


def test_a_tilted_base_turns_the_weight(quiet_robot):
    joint = quiet_robot(gravity=True)
    robot, tilt = joint.robot, 0.02
    q, _ = joint.run(joint.experiment(6.0), base_tilt=tilt)
    moment = robot.mass[0] * G * robot.com[0]
    still = brentq(lambda x: robot.kp[0] * robot.ratio[0] * (robot.pose[0] - x)
                   - moment * np.cos(x + tilt), robot.pose[0] - 1, robot.pose[0] + 1)
    assert q[-1, 0] == pytest.approx(still, abs=1e-6)


def test_a_counterbalance_pulls_along_the_slope_of_its_energy(quiet_robot):
    joint = quiet_robot()
    robot, angle, slack = joint.robot, joint.robot.pose[0] + 1.2, 0.4
    moment = 0.05 * robot.kp[0] * robot.ratio[0]
    q, _ = joint.run(joint.experiment(6.0), balance=moment, balance_angle=angle,
                     balance_slack=slack)

    def energy(x):
        length = np.hypot(LEVER * np.cos(x) - ANCHOR * np.cos(angle),
                          LEVER * np.sin(x) - ANCHOR * np.sin(angle))
        return (0.5 * moment / (ANCHOR * LEVER) * (length - slack * ANCHOR) ** 2
                + 0.5 * robot.kp[0] * robot.ratio[0] * (x - robot.pose[0]) ** 2)

    slope = (energy(q[-1, 0] + 1e-5) - energy(q[-1, 0] - 1e-5)) / 2e-5
    assert abs(q[-1, 0] - robot.pose[0]) > 0.01
    assert abs(slope) < 1e-4 * moment


def test_fluid_takes_the_power_of_every_strip(quiet_robot, one_lane):
    robot = quiet_robot("arm", seed=5).robot
    rng, density = np.random.default_rng(2), 0.7
    q, dq = rng.uniform(-1, 1, (2, 1, robot.n))
    drag = FluidDrag(robot, one_lane(robot.n, fluid=density))
    torque = drag(Moment(0.0, q, dq, 0 * q)) * robot.ratio

    def strip(i, s, angles):
        turned = np.cumsum(angles)
        ends = np.array([robot.length[:i] @ f(turned[:i]) for f in (np.cos, np.sin)])
        return ends + s * np.array([np.cos(turned[i]), np.sin(turned[i])])

    power, t = 0.0, 1e-6
    for i in range(robot.n):
        normal = np.array([-np.sin(q[0, :i + 1].sum()), np.cos(q[0, :i + 1].sum())])
        at, width = np.linspace(0, robot.length[i], 401, retstep=True)
        speed = [normal @ (strip(i, s, q[0] + t * dq[0]) - strip(i, s, q[0] - t * dq[0])) / (2 * t)
                 for s in at]
        power += density * np.trapezoid(np.abs(speed) ** 3, dx=width)
    assert (torque * dq).sum() == pytest.approx(power, rel=0.02)


def test_a_single_link_feels_the_square_of_its_speed(quiet_robot, one_lane):
    robot = quiet_robot().robot
    drag = FluidDrag(robot, one_lane(fluid=1.0))
    one, back = (drag(Moment(0.0, np.zeros((1, 1)), np.array([[w]]), np.zeros((1, 1))))[0, 0]
                 for w in (2.0, -1.0))
    assert one == pytest.approx(4 * robot.length[0] ** 4 / 4 / robot.ratio[0])
    assert back == pytest.approx(-one / 4)


def test_a_hose_forgets_where_it_was(one_lane, along):
    path = np.concatenate([[0.0], np.full(5000, 0.1)])
    pull = along(Hose(one_lane(hose=3.0, hose_time=0.2), 1e-4), path)[1:]
    assert pull == pytest.approx(0.3 * np.exp(-1e-4 * np.arange(1, 5001) / 0.2), rel=1e-6)


@pytest.mark.parametrize("part, energy", [
    (NeighbourSpring, lambda q, pose, ratio: 0.5 * 2.0 * ratio[1]
     * (q[0] - pose[0]) * (q[1] - pose[1]) ** 2),
    (Detent, lambda q, pose, ratio: -2.0 * ratio[1] * np.cos(7 * (q[1] - q[0])) / 7)])
def test_neighbours_pull_along_the_slope_of_one_energy(quiet_robot, one_lane, part, energy):
    robot = quiet_robot("arm", seed=5).robot
    p = one_lane(robot.n)
    for key, value in {"neighbour": 2.0, "detent": 2.0, "detent_teeth": 7.0}.items():
        p[key][0, 1] = value
    q = robot.pose + np.linspace(0.1, 0.3, robot.n)
    torque = part(robot, p)(Moment(0.0, q[None], 0 * q[None], 0 * q[None]))[0] * robot.ratio
    steps = 1e-6 * np.eye(robot.n)
    slope = [(energy(q + step, robot.pose, robot.ratio)
              - energy(q - step, robot.pose, robot.ratio)) / 2e-6 for step in steps]
    assert torque == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_an_imbalance_that_runs_up_grows_with_the_square_of_its_rate(one_lane):
    part = Imbalance(one_lane(imbalance=1.0, imbalance_hz=5.0), np.array([[10.0]]))
    t = np.arange(100_000) * 1e-4
    wave = np.array([part(Moment(x, *(np.zeros((1, 1)),) * 3))[0, 0] for x in t[::10]])
    assert wave[:300].max() == pytest.approx(1, rel=0.15)
    assert wave[-300:].max() == pytest.approx(9, rel=0.05)
    rises = [np.sum(np.diff(np.sign(part)) > 0) for part in (wave[:2000], wave[-2000:])]
    assert rises[1] / rises[0] == pytest.approx(2.8 / 1.2, rel=0.1)


def test_a_pendulum_at_the_tip_weighs_what_a_payload_weighs(quiet_robot):
    joint = quiet_robot(gravity=True)
    slow = joint.experiment(5.0)
    hung, fixed = (joint.run(slow, **{key: 0.02}, slosh_length=0.2)[0][-1, 0]
                   for key in ("slosh", "payload"))
    assert hung == pytest.approx(fixed, abs=5e-5)
    assert abs(joint.run(slow)[0][-1, 0] - fixed) > 1e-3


@pytest.mark.parametrize("key, factor", [("link_stiffness", 50.0), ("mount_stiffness", 1e3)])
def test_what_is_stiff_is_the_stated_robot_and_what_is_soft_is_not(quiet_robot, key, factor):
    joint = quiet_robot()
    experiment = joint.experiment(0.5, torque=0.2 * joint.robot.kp)
    stated = joint.run(experiment)[0]
    unit = np.max(joint.robot.kp * joint.robot.ratio)
    stiff, soft = (np.max(np.abs(joint.run(experiment, **{key: unit * times})[0] - stated))
                   for times in (factor, 0.5))
    assert 1e-9 < stiff < 0.05 * soft


def test_a_soft_mount_rings_at_the_frequency_of_two_coupled_bodies(quiet_robot):
    joint = quiet_robot()
    robot = joint.robot = dataclasses.replace(joint.robot, kd=0 * joint.robot.kd)
    link, rotor = robot.link[0], joint.truth["rotor"][0] * robot.ratio[0] ** 2
    spring, stiffness = robot.kp[0] * robot.ratio[0], 9 * robot.kp[0] * robot.ratio[0]
    mass = np.array([[2 * link, link], [link, link + rotor]])
    fast = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, np.diag([stiffness, spring])))).max()
    torque = 0.05 * robot.kp
    (q, _), (rigid, _) = (joint.run(joint.experiment(4.0, torque=torque), drag=0.0,
                                    mount_stiffness=k) for k in (stiffness, 0.0))
    curve = np.diff(q[:, 0], 2)
    spectrum = np.abs(np.fft.rfft(curve * np.hanning(len(curve)), 1 << 16))
    found = 2 * np.pi * np.fft.rfftfreq(1 << 16, 1e-3)
    above = found > 0.7 * fast
    assert found[above][spectrum[above].argmax()] == pytest.approx(fast, rel=0.05)
