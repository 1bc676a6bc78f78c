"""Velocity filters as coefficients: frequency response, slope of a ramp, settling."""

import numpy as np
import pytest
from scipy import signal

from clie_blocks.analysis.records.velocity_filter import (
    discretisations,
    response_from_rest,
    settling,
    velocity_filter,
)
from clie_blocks.linear_filters import DISCRETISATIONS

STEP, CORNERS = 1e-3, (200.0, 300.0)


@pytest.mark.parametrize("name, method", [("tustin", "bilinear"), ("backward", "backward_diff"),
                                          ("forward", "euler"), ("zoh", "zoh")])
def test_g1_is_discretised_as_scipy_does(name, method):
    high, low = CORNERS
    continuous = [high * low, 0.0], np.convolve([1.0, high], [1.0, low])
    b, a, _ = signal.cont2discrete(continuous, STEP, method)
    mine = velocity_filter(name, STEP, CORNERS)
    z = np.exp(2j * np.pi * np.geomspace(0.1, 200.0, 30) * STEP)
    assert np.allclose(np.polyval(mine[0], z) / np.polyval(mine[1], z),
                       np.polyval(np.ravel(b), z) / np.polyval(a, z))


@pytest.mark.parametrize("name", [*DISCRETISATIONS, "two_tap", "difference"])
def test_every_filter_gives_the_slope_of_a_ramp(name):
    ramp = 0.7 * STEP * np.arange(2000)
    b, a = velocity_filter(name, STEP, CORNERS)
    nearly = 0.01 if name == "zoh" else 1e-9
    assert signal.lfilter(b, a, ramp)[-1] == pytest.approx(0.7, rel=nearly)


@pytest.mark.parametrize("name", [*DISCRETISATIONS, "two_tap"])
def test_a_settled_filter_has_forgotten_its_start(name):
    b, a = velocity_filter(name, STEP, CORNERS)
    start = np.abs(signal.lfilter(b, a, np.ones(400)))
    assert start[settling(a):].max() < 1e-3 * start.max()


@pytest.mark.parametrize("pole", [0.5, 0.999, 0.99995, 1 - 1e-14, -1 + 1e-13])
def test_a_transform_gives_the_response_of_the_recursion(pole):
    b, a, x = np.array([1.0, -1.0, 0.0]), np.array([1.0, -pole, 0.0]), np.eye(300)[:, :2]
    np.testing.assert_allclose(response_from_rest(b, a, x), signal.lfilter(b, a, x, axis=0),
                               atol=1e-12)


def test_a_discretisation_that_hardly_settles_is_not_offered():
    assert "forward" not in discretisations(0.005, (150.0, 400.0))  # a pole at -1
    assert "tustin" in discretisations(0.005, (150.0, 400.0))


def test_an_unstable_discretisation_is_not_offered():
    assert discretisations(STEP, CORNERS) == DISCRETISATIONS
    assert "forward" not in discretisations(10 * STEP, CORNERS)


@pytest.mark.parametrize("corners", [(200.0, 300.0), (200.0, 1e7), (1e7, 200.0), (1e7, 1e7)])
def test_zero_order_hold_keeps_the_step_response_however_far_apart_the_corners(corners):
    b, a = velocity_filter("zoh", STEP, corners)
    (high, low), t = corners, STEP * np.arange(5)
    exact = 0.0 * t if high == low else high * low / (low - high) * (
        np.exp(-high * t) - np.exp(-low * t))
    np.testing.assert_allclose(signal.lfilter(b, a, np.ones(5)), exact, rtol=1e-9, atol=1e-9)
