"""Loads against energies and against the full arm, which has them built in."""

import numpy as np
import pytest
from effect_runs import one_joint, run_plant

from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.base_tilt import base_tilt_torque
from clie_blocks.effects.counterbalance import counterbalance_torque
from clie_blocks.effects.fluid_drag import fluid_drag_torque
from clie_blocks.effects.gravity import gravity_torque
from clie_blocks.effects.spring import spring_torque
from clie_blocks.joints import inertial_joints
from clie_blocks.manipulator import GRAVITY, gravity, two_link_arm

R = np.array([50.0, 80.0])
LENGTH, COM = np.array([0.6, 0.5]), np.array([0.4, 0.3])
MASS, J_LINK = np.array([1.5, 0.8]), np.array([0.02, 0.01])
J_MOTOR, B_MOTOR = np.array([4e-4, 3e-4]), np.array([1e-3, 2e-3])


def arm(mass=MASS, com=COM, j_link=J_LINK, g=GRAVITY):
    return two_link_arm(mass, LENGTH, R, J_MOTOR, B_MOTOR, com=com, j_link=j_link, g=g)


def assert_same_plant(first, second, tolerance=1e-11):
    rng = np.random.default_rng(4)
    for _ in range(20):
        x, u = rng.normal(size=4), rng.normal(size=2)
        np.testing.assert_allclose(first.dynamics(0, x, u), second.dynamics(0, x, u),
                                   rtol=tolerance, atol=tolerance)


def weight():
    return np.array([MASS[0] * COM[0] + MASS[1] * LENGTH[0], MASS[1] * COM[1]]) * GRAVITY


def test_gravity_is_that_of_the_arm():
    heavy = LIBRARY["gravity"](weight=weight(), gear_ratio=R)
    assert_same_plant(with_effects(arm(g=0.0), [heavy]), arm())
    q = np.array([0.3, -0.7])
    np.testing.assert_allclose(gravity_torque(q, weight(), R), gravity(q, MASS, LENGTH, COM) / R)


def test_payload_is_a_heavier_tip():
    """A point mass at the tip: the arm whose second link is a point mass there, made heavier."""
    at_tip = np.array([COM[0], LENGTH[1]])
    light = arm(com=at_tip, j_link=[0.02, 0.0])
    heavy = arm(mass=MASS + [0.0, 0.7], com=at_tip, j_link=[0.02, 0.0])
    payload = LIBRARY["payload"](mass=0.7, length=LENGTH, gear_ratio=R)
    assert_same_plant(with_effects(light, [payload]), heavy)


def test_decoupled_joints_with_coupling_and_gravity_are_the_arm():
    about_1 = MASS[0] * COM[0] ** 2 + MASS[1] * LENGTH[0] ** 2 + J_LINK[0]
    about_2 = MASS[1] * COM[1] ** 2 + J_LINK[1]
    joints = inertial_joints(R * J_MOTOR + np.array([about_1 + about_2, about_2]) / R,
                             R * B_MOTOR, [0.0, 0.0])
    moment = MASS[1] * LENGTH[0] * COM[1]
    effects = [LIBRARY["coupling"](moment=[0.0, moment], turning=[0.0, about_2], gear_ratio=R),
               LIBRARY["gravity"](weight=weight(), gear_ratio=R)]
    assert_same_plant(with_effects(joints, effects), arm())


def slope(energy, q, h=1e-6):
    return (energy(q + h) - energy(q - h)) / (2 * h)


@pytest.mark.parametrize("q", np.linspace(-2.5, 2.5, 7))
def test_springs_are_slopes_of_their_energies(q):
    def cable(q):
        x = q - 0.2
        return 0.4 * (x**2 / 2 + 0.3 * x**4 / 4)

    def balance(q):
        length = np.sqrt(1 + 0.3**2 - 2 * 0.3 * np.cos(q - 1.1))
        return 0.7 / 0.3 * (length - 0.4) ** 2 / 2

    assert spring_torque(q, 0.4, 0.2, 0.3) == pytest.approx(slope(cable, q), abs=1e-8)
    assert counterbalance_torque(q, 0.7, 0.3, 0.4, 1.1) == pytest.approx(
        slope(balance, q), abs=1e-8)


def test_a_spring_without_free_length_balances_the_weight_at_every_pose():
    q = np.linspace(-3, 3, 50)
    left = 0.8 * np.cos(q) + counterbalance_torque(q, 0.8, 0.3, 0.0, np.pi / 2)
    np.testing.assert_allclose(left, 0.0, atol=1e-15)


def test_energy_of_a_pendulum_on_a_spring_is_kept():
    effects = [LIBRARY["gravity"](weight=0.8), LIBRARY["spring"](stiffness=0.5, hardening=0.3)]
    t, q, dq = run_plant(one_joint(*effects, a=1e-12), 0.0, 20.0, state={"plant_q[0]": 1.2})
    energy = dq**2 / 2 / 0.5 + 0.8 * np.sin(q) + 0.5 * (q**2 / 2 + 0.3 * q**4 / 4)
    assert np.ptp(q) > 1.0
    assert np.ptp(energy) < 1e-9 * np.max(np.abs(energy))


def test_tilting_the_base_turns_gravity():
    q, w = np.array([0.4, -1.0]), np.array([0.9, 0.4])
    turned = gravity_torque(q + [0.05, 0.0], w) - gravity_torque(q, w)
    np.testing.assert_allclose(base_tilt_torque(q, 0.05, w), turned, rtol=1e-13)


def test_fluid_drag_is_felt_by_the_joints_before():
    drag = np.array([0.0, 0.02])
    np.testing.assert_allclose(fluid_drag_torque(np.array([3.0, -1.0]), drag), 0.02 * 4.0)
    np.testing.assert_allclose(fluid_drag_torque(np.array([1.0, -1.0]), drag), 0.0)


def test_a_stop_pushes_back_and_takes_the_stated_share_of_speed():
    speed, damping = 0.2, 0.3
    plant = one_joint(LIBRARY["soft_stop"].typical(stiffness=200.0, damping=damping), a=1e-12)
    _, q, dq = run_plant(plant, 0.0, 2.0, step=1e-4,
                         state={"plant_q[0]": 0.9, "plant_dq[0]": speed})
    assert np.max(q) > 1.0 and q[-1] < 0.9
    assert -dq[-1] / speed == pytest.approx(1 - 2 / 3 * damping * speed, abs=2e-3)
