import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from clie_blocks import paper
from clie_blocks.joints import (
    decoupled_joints,
    estimated_model,
    held_joint_step,
    inertial_joints,
    motor_side,
    normalised,
)
from clie_blocks.manipulator import mass_matrix
from clie_blocks.signals import DiagramError

positive = st.floats(0.05, 20)


def test_the_two_forms_of_a_joint_are_one_system():
    inertia, damping, load = np.array([2.0, 0.7]), np.array([4.0, 1.0]), np.array([0.3, -0.1])
    forms = [inertial_joints(inertia, damping, load),
             decoupled_joints(*normalised(inertia, damping, load))]
    x, u = np.array([0.1, -0.2, 0.3, 0.4]), np.array([1.0, -2.0])
    np.testing.assert_allclose(forms[0].dynamics(0, x, u), forms[1].dynamics(0, x, u), rtol=1e-14)


def test_free_motion_decays_to_the_closed_form():
    a, dq_0 = 2.0, 1.5
    joint = decoupled_joints([a], [0.5], [0.0])
    run = solve_ivp(lambda t, x: joint.dynamics(t, x, [0.0]), (0, 3), [0.0, dq_0], rtol=1e-10,
                    atol=1e-12)
    assert run.y[0, -1] == pytest.approx(dq_0 / a * (1 - np.exp(-3 * a)), rel=1e-7)


def test_estimated_model_with_the_true_parameters_is_the_plant():
    theta = paper.THETA
    plant, model = decoupled_joints(*theta.reshape(3, 2)), estimated_model(2)
    x, u = np.array([0.1, -0.2, 0.3, 0.4]), np.array([1.0, -2.0])
    np.testing.assert_array_equal(plant.dynamics(0, x, u),
                                  model.dynamics(0, x, np.concatenate((u, theta))))


@given(st.one_of(st.just(0.0), st.floats(-3, 30)), positive, st.floats(-2, 2), st.floats(-3, 3),
       st.floats(-5, 5), st.floats(1e-4, 0.05))
def test_held_step_is_exact(a, b, d, dq, u, period):
    q_end, dq_end = held_joint_step(0.2, dq, u, a, b, d, period)
    run = solve_ivp(lambda t, x: [x[1], -a * x[1] + b * u - d], (0, period), [0.2, dq],
                    rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose([q_end, dq_end], run.y[:, -1], rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("x", [0.0, 1e-14, 1e-9, 2e-6, 1e-3, 0.0299, 0.0301, 0.5, -2e-6, -0.5])
def test_held_step_has_no_cancellation_near_zero_damping(x):
    """Second route in 50 digits: the matrix exponential of the held joint."""
    with mpmath.workdps(50):
        period = mpmath.mpf(1) / 64
        a = mpmath.mpf(x) / period
        exact = mpmath.expm(mpmath.matrix([[0, 1, 0], [0, -a, 1], [0, 0, 0]]) * period)
        wanted = [float(exact[0, 1]), float(exact[0, 2]), float(exact[1, 1])]
    travel, decay = held_joint_step(0.0, 1.0, 0.0, x * 64, 1.0, 0.0, 1 / 64)
    push, _ = held_joint_step(0.0, 0.0, 1.0, x * 64, 1.0, 0.0, 1 / 64)
    np.testing.assert_allclose([travel, push, decay], wanted, rtol=2e-14)


def test_reduction_gives_the_ratio_of_a_to_b_that_physics_forces():
    """A/B = R r for any inertia; Table 2 breaks it for joint 2 (A2/B2 = 3.992, not 4)."""
    mass = np.diag(mass_matrix(paper.SET_POINT, paper.MASS, paper.LENGTH, paper.LENGTH,
                               np.zeros(2)))
    a, b, _ = normalised(*motor_side(mass, 0.0, paper.GEAR_RATIO, paper.J_MOTOR, paper.B_MOTOR))
    np.testing.assert_allclose(a / b, paper.B_MOTOR * paper.GEAR_RATIO, rtol=1e-14)
    ratio = paper.THETA[:2] / paper.THETA[2:4]
    assert abs(ratio[0] - 4) < 5e-3 and ratio[1] == pytest.approx(3.9920, abs=1e-4)


def test_reduction_signs_and_gear_attenuation():
    inertia, damping, load = motor_side([0.5], [4.0], [100.0], [0.02], [0.04], eta=[3.0],
                                        delta_r=[1.0], delta_m=[0.2])
    assert inertia == pytest.approx(0.02 * 100 + 0.5 / 100)
    assert damping == pytest.approx(0.04 * 100 + 4.0 / 100)
    assert load == pytest.approx((3.0 - 1.0) / 100 - 0.2)  # eq. (7); (10) lost a fraction bar


@pytest.mark.parametrize("arguments, message", [
    (([0.0], [1.0], [0.0]), "plant: a must be greater than 0"),
    (([1.0], [-1.0], [0.0]), "plant: b must be greater than 0"),
    (([1.0, 1.0], [1.0, 1.0], [0.0, 0.0, 0.0]), "plant: d needs 2 numbers")])
def test_bad_parameters_are_named(arguments, message):
    with pytest.raises(DiagramError, match=message):
        decoupled_joints(*arguments)
