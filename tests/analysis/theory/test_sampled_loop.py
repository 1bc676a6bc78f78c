"""The sampled loop of one joint, against python-control and against sample-by-sample runs."""

import control as ct
import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.theory.sampled_loop import (
    decimated_filter,
    held_plant,
    loop_polynomials,
)

STEP = 1e-3


def response(numerator, denominator, z):
    return np.polyval(numerator[::-1], 1 / z) / np.polyval(denominator[::-1], 1 / z)


@pytest.mark.parametrize("viscous", [-0.5, -1e-6, 0.0, 1e-6, 0.05, 10.0])
def test_the_held_plant_agrees_with_python_control(viscous):
    plant = ct.sample_system(ct.tf([1], [0.5, viscous, 0]), STEP, "zoh")
    z = np.exp(1j * np.array([1.0, 30.0, 900.0]) * STEP)
    assert np.allclose(response(*held_plant(0.5, viscous, STEP), z), plant(z), rtol=1e-5)


def test_a_joint_without_damping_moves_as_a_double_integrator():
    period = 2e-3
    numerator, denominator = held_plant(1.0, 0.0, period)
    half = period**2 / 2
    assert numerator == pytest.approx([0.0, half, half], rel=1e-5)
    np.testing.assert_allclose(denominator, [1.0, -2.0, 1.0], atol=1e-8)


def test_both_sensitivities_agree_with_python_control():
    g1 = ct.sample_system(ct.tf([200 * 300, 0], [1, 500, 60000]), STEP, "tustin")
    filter_ = (g1.num[0][0], g1.den[0][0])
    plant = ct.sample_system(ct.tf([1], [0.5, 1.0, 0]), STEP, "zoh")
    law = 20.0 + 4.0 * g1
    torque, sensor, denominator = loop_polynomials(held_plant(0.5, 1.0, STEP), 20.0, 4.0, filter_)
    z = np.exp(1j * np.geomspace(0.1, 1000, 40) * STEP)
    assert np.allclose(response(torque, denominator, z), ct.feedback(plant, law)(z), rtol=1e-6)
    assert np.allclose(response(sensor, denominator, z), 1 / (1 + plant(z) * law(z)), rtol=1e-6)


@pytest.mark.parametrize("stride", [1, 4, 8])
def test_the_decimated_filter_is_exact_for_inputs_that_are_constant_over_a_block(stride):
    b, a = np.array([0.1, 0.3, 0.0]), np.array([1.0, -1.2, 0.5])
    blocks = np.random.default_rng(4).standard_normal(50)
    seen = lfilter(b, a, np.repeat(blocks, 8)).reshape(50, 8)[:, ::stride].mean(axis=1)
    assert np.allclose(lfilter(*decimated_filter(b, a, 8, stride), blocks), seen, atol=1e-12)
