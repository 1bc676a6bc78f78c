import control as ct
import numpy as np
import pytest

from clie_blocks.filters import difference_filter, lowpass, lowpass_with_rate, velocity_filter
from clie_blocks.signals import DiagramError

OMEGA = np.logspace(-1, 4, 60)


def response(block, out, inp):
    return block(1j * OMEGA, squeeze=False)[out, inp]


def test_g1_is_eq_47():
    s = 1j * OMEGA
    expected = 200 * s / (s + 200) * 300 / (s + 300)
    block = velocity_filter(2)
    np.testing.assert_allclose(response(block, 0, 0), expected, rtol=1e-10)
    np.testing.assert_allclose(response(block, 1, 1), expected, rtol=1e-10)
    np.testing.assert_array_equal(response(block, 0, 1), 0)


def test_g1_keeps_the_slope_and_delays_by_the_sum_of_its_lags():
    s = 1e-3j
    value = velocity_filter(1)(s)
    assert value.imag == pytest.approx(1e-3, rel=1e-6)
    assert -(np.angle(value) - np.pi / 2) / 1e-3 == pytest.approx(1 / 200 + 1 / 300, rel=1e-4)


def test_g1_at_rest_state_gives_zero_velocity():
    q_0 = 0.7
    block = velocity_filter(1)
    x = np.array([q_0, 0.0])
    np.testing.assert_array_equal(block.A @ x + block.B[:, 0] * q_0, 0)
    assert (block.C @ x).item() == 0


def test_g2_and_the_rate_that_replaces_the_acceleration():
    s = 1j * OMEGA
    np.testing.assert_allclose(response(lowpass(2, omega_f=300.0), 1, 1), 300 / (s + 300),
                               rtol=1e-10)
    rate = lowpass_with_rate(2, omega_f=300.0)
    np.testing.assert_allclose(response(rate, 0, 0), 300 / (s + 300), rtol=1e-10)
    np.testing.assert_allclose(response(rate, 2, 0), s * 300 / (s + 300), rtol=1e-8)
    assert rate.output_labels == ["dq_f[0]", "dq_f[1]", "y_f[0]", "y_f[1]"]


@pytest.mark.parametrize("taps", [1, 2, 3])
def test_difference_filter_is_the_difference(taps):
    period, n = 1e-3, 2
    block = difference_filter(n, period, taps=taps)
    q = np.random.default_rng(0).normal(size=(n, 12))
    q[:, :taps] = q[:, :1]
    x_0 = np.repeat(q[:, 0], taps)
    run = ct.forced_response(block, inputs=q, initial_state=x_0, squeeze=False)
    expected = (q[:, taps:] - q[:, :-taps]) / (taps * period)
    np.testing.assert_allclose(run.outputs[:, taps:], expected, rtol=1e-12)
    np.testing.assert_allclose(run.outputs[:, 0], 0, atol=1e-12)


def test_bad_corner_is_named():
    with pytest.raises(DiagramError, match="velocity_filter: highpass must be positive"):
        velocity_filter(1, highpass=-1.0)
