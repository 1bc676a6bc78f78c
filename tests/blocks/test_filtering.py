"""Filters without scipy.signal give what scipy.signal gives."""

import numpy as np
import pytest
from scipy import signal

from clie_blocks.linear_filters import butterworth, frequency_response, high_pass


@pytest.mark.parametrize("order, corner, rate", [(4, 60.0, 1000.0), (2, 20.0, 1000.0),
                                                 (4, 60.0, 4000.0), (2, 20.0, 100.0)])
def test_what_lies_above_a_corner_is_what_scipy_finds(order, corner, rate):
    x = np.cumsum(np.random.default_rng(0).standard_normal((3000, 2)), axis=0)
    sections = signal.butter(order, corner, "high", fs=rate, output="sos")
    for each in (x, x[:, 0]):
        np.testing.assert_allclose(high_pass(each, order, corner, rate),
                                   signal.sosfiltfilt(sections, each, axis=0), atol=1e-8)


def test_butterworth_halves_the_power_at_its_corner():
    b, a = butterworth(4, 60.0, 1000.0)
    np.testing.assert_allclose(np.abs(frequency_response(b, a, [1e-9, 0.12 * np.pi, np.pi])),
                               [0.0, np.sqrt(0.5), 1.0], atol=1e-9)


def test_responses_are_those_of_scipy():
    b, a = signal.butter(3, [0.1, 0.3], "band")
    grid = np.linspace(0.01, np.pi, 50)
    np.testing.assert_allclose(frequency_response(b, a, grid), signal.freqz(b, a, grid)[1], rtol=1e-9)
    np.testing.assert_allclose(frequency_response(b, [2.0], grid), signal.freqz(b, [2.0], grid)[1],
                               rtol=1e-9)
