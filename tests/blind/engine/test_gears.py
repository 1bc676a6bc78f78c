"""Gears that bend, slip, wobble or pull a neighbour, by energy and by early acceleration."""

import dataclasses

import mujoco
import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.control_loop import run_both
from clie_blocks.analysis.blind.engine.disturbances import Disturbances
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.variable_gear import motor_per_link
from clie_blocks.analysis.blind.engine.world import build_model


def model_of(joint, **parameters):
    lane = {**joint.truth, **{key: np.full(joint.robot.n, value)
                              for key, value in parameters.items()}}
    return build_model(joint.robot, [lane])


def test_a_stiffening_gear_is_twice_as_stiff_at_its_knee(quiet_robot):
    model = model_of(quiet_robot(), twist_stiffness=50.0, twist_knee=0.02)
    data = mujoco.MjData(model)
    twist = model.joint("b0_0").id
    for x in (0.001, 0.02, -0.02):
        data.qpos[twist] = x
        mujoco.mj_forward(model, data)
        assert data.qfrc_spring[twist] == pytest.approx(-50 * x * (1 + (x / 0.02) ** 2), rel=1e-9)


def test_a_slipping_gear_loses_the_area_of_its_loop(quiet_robot):
    level, slope, spring = 2.0, 400.0, 300.0
    joint = quiet_robot()
    model = model_of(joint, twist_stiffness=spring, twist_slip=level, twist_slip_stiffness=slope,
                     twist_damping=1.0, stiffness=1e5, rest=joint.robot.pose[0])
    data = mujoco.MjData(model)
    data.qpos[model.joint("a0_0").id] = joint.robot.pose[0]
    twist, count = model.joint("b0_0").id, 4000
    x, torque = np.empty((2, 2 * count))
    for i in range(2 * count):
        torque[i] = data.qfrc_applied[twist] = 6.0 * np.sin(2 * np.pi * i / count)
        mujoco.mj_step(model, data)
        x[i] = data.qpos[twist]
    area = np.trapezoid(torque[count:], x[count:])
    amplitude, reach = np.ptp(x[count:]) / 2, level / slope
    turn = level * np.tanh(amplitude / reach)
    exact = 2 * (2 * level * amplitude
                 - (level + turn) * reach * (1 - np.exp(-2 * amplitude / reach)))
    viscous = np.pi * 1.0 * amplitude**2 * 2 * np.pi / (count * model.opt.timestep)
    assert area == pytest.approx(exact + viscous, rel=0.05)


@pytest.mark.parametrize("kind", ["pendulum", "axes"])
def test_a_wobbling_gear_makes_no_energy(quiet_robot, kind):
    joint = quiet_robot(kind)
    zero = 0 * joint.robot.kp
    robot = joint.robot = dataclasses.replace(joint.robot, kp=zero, kd=zero, bearing=zero)
    rotor = joint.truth["rotor"][0] * robot.ratio[0] ** 2
    link = 0.0 if kind == "axes" else robot.link[0]  # there the rotors count the links
    torque, order = (link + rotor) / robot.ratio[0], 15.0
    wobble = {"wobble": 0.03, "wobble_order": order, "phase": 0.4}
    q, _ = joint.run(joint.experiment(1.0, torque=torque), drag=0.0, **wobble)
    p = {key: np.full(robot.n, value) for key, value in wobble.items()}
    slope = motor_per_link(q, p)[0]
    turned = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1])[:, 0] / 2
                                              * np.diff(q[:, 0]))])
    speed = np.gradient(q[:, 0], robot.period)
    energy = 0.5 * (link + rotor * slope[:, 0] ** 2) * speed**2
    work = torque * robot.ratio[0] * turned
    assert np.ptp(q) > 2 * np.pi / order
    assert energy[5:-5] == pytest.approx(work[5:-5], rel=0.01, abs=2e-3 * work.max())


def test_the_motor_of_a_wobbling_gear_turns_by_the_inverse_of_its_error():
    p = {"wobble": np.array([2e-3]), "wobble_order": np.array([100.0]), "phase": np.array([0.3])}
    m = np.linspace(0, 0.2, 20001)[:, None]
    q = m + p["wobble"] * np.sin(p["wobble_order"] * m + p["phase"])
    first, second = motor_per_link(q, p)
    assert first[1:-1, 0] == pytest.approx(np.gradient(m[:, 0], q[:, 0])[1:-1], rel=1e-4)
    slope = np.gradient(first[:, 0], q[:, 0])
    assert second[5:-5, 0] == pytest.approx(slope[5:-5], rel=1e-3, abs=0.1)


def test_teeth_ripple_more_the_more_they_carry(quiet_robot, one_lane):
    p = one_lane(mesh=0.1, mesh_depth=0.05, teeth=30.0)
    ripple = Disturbances(quiet_robot().robot, p, np.ones((1, 1)), None, 1e-3)
    crest = np.full((1, 1), np.pi / 60)
    for u in (0.0, 4.0, -4.0):
        torque = ripple.torque(Moment(0.0, crest, 0 * crest, np.full((1, 1), u)))
        assert torque[0, 0] == pytest.approx(0.1 + 0.05 * abs(u))


def test_a_motor_on_a_belt_over_its_neighbour_pulls_that_as_well(quiet_robot):
    arm = quiet_robot("arm", seed=1)
    torque, zero = 0.2 * arm.robot.kp * np.array([0.0, 1.0]), np.zeros(2)
    robot = arm.robot = dataclasses.replace(arm.robot, kp=zero, kd=zero, bearing=zero)
    travel = 0.3
    one = arm.experiment(0.01)
    experiment = dataclasses.replace(one, pe=np.broadcast_to(torque, one.q_d.shape))
    arm.truth["travel_of_neighbour"] = np.array([0.0, travel])
    q, _ = arm.run(experiment, drag=0.0)
    (m1, m2), (c1, c2), (i1, i2) = robot.mass, robot.com, robot.inertia
    reach = robot.length[0] * c2 * np.cos(robot.pose[1])
    coupled = i2 + m2 * (c2**2 + reach)
    links = np.array([[i1 + m1 * c1**2 + i2 + m2 * (robot.length[0]**2 + c2**2 + 2 * reach),
                       coupled], [coupled, i2 + m2 * c2**2]])
    rotors, pull = arm.truth["rotor"] * robot.ratio**2, np.array([-travel, 1.0])
    mass = links + np.diag([rotors[0], 0.0]) + rotors[1] * np.outer(pull, pull)
    start = np.linalg.solve(mass, pull * (robot.ratio * torque)[1])
    t = robot.period * (len(q) - 1)
    assert (q[-1] - q[0]) / (0.5 * t**2) == pytest.approx(start, rel=0.08)


def test_a_gear_of_another_ratio_accelerates_as_its_own_ratio_says(quiet_robot):
    joint = quiet_robot()
    robot, torque = joint.robot, 0.2 * joint.robot.kp[0]
    q, _ = joint.run(joint.experiment(0.01, torque=torque), drag=0.0, ratio_error=0.25)
    ratio = robot.ratio[0] / 1.25
    expected = ratio * torque / (robot.link[0] + joint.truth["rotor"][0] * ratio**2)
    t = robot.period * (len(q) - 1)
    assert (q[-1, 0] - q[0, 0]) / (0.5 * t**2) == pytest.approx(expected, rel=0.08)


def both_encoders(joint, **parameters):
    """Positions at the law's encoder and at the other one, without noise."""
    lane = {**joint.truth, **{key: np.full(joint.robot.n, value)
                              for key, value in parameters.items()}}
    quiet = dataclasses.replace(joint.robot, sigma=0.0 * joint.robot.sigma)
    experiment = joint.experiment(0.4, torque=0.3 * joint.robot.kp)
    (log,) = run_both(quiet, [lane], [experiment], [np.zeros(experiment.q_d.shape)])
    return log[0], log[2]


@pytest.mark.parametrize("on_motor", [False, True])
def test_encoders_of_motor_and_link_see_their_ends_of_a_gear(quiet_robot, on_motor):
    joint = quiet_robot()
    joint.robot = dataclasses.replace(joint.robot, encoder_on_motor=on_motor, two_encoders=True)
    step = joint.robot.resolution[0]

    def link_and_motor(**parameters):
        law, other = both_encoders(joint, **parameters)
        return (other, law) if on_motor else (law, other)

    link, motor = link_and_motor()
    assert np.abs(link - motor).max() < step
    link, motor = link_and_motor(wobble=2e-3, wobble_order=12.0, phase=0.4)
    assert link == pytest.approx(motor + 2e-3 * np.sin(12 * motor + 0.4), abs=1.5 * step)
    link, motor = link_and_motor(ratio_error=0.05)
    assert link == pytest.approx(1.05 * motor, abs=1.5 * step)
    link, motor = link_and_motor(twist_stiffness=50.0, twist_damping=0.5)
    assert 10 * step < np.abs(link - motor).max() < 0.1
