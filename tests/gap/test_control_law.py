"""The law as a difference equation: textbook discretisations, and replay."""

import dataclasses

import numpy as np
import pytest
import scipy.signal

from clie_blocks.analysis.gap.control_law import replay, velocity_estimate
from clie_blocks.analysis.gap.controller_check import controller_check


@pytest.mark.parametrize("name, method", [("tustin", "bilinear"), ("backward", "backward_diff"),
                                          ("forward", "euler")])
def test_g1_is_discretised_as_scipy_does(name, method):
    high, low, period = 200.0, 300.0, 1e-3
    continuous = [high * low, 0.0], np.convolve([1.0, high], [1.0, low])
    b, a, _ = scipy.signal.cont2discrete(continuous, period, method)
    mine = velocity_estimate("two_corner", period, (high, low), name)
    frequency = 2j * np.pi * np.geomspace(0.1, 200.0, 30)
    z = np.exp(frequency * period)
    assert np.allclose(np.polyval(mine[0], z) / np.polyval(mine[1], z),
                       np.polyval(np.ravel(b), z) / np.polyval(a, z))


def test_every_estimate_gives_the_slope_of_a_ramp():
    ramp = 0.7 * 1e-3 * np.arange(2000)
    for kind in ("two_corner", "two_tap", "difference"):
        b, a = velocity_estimate(kind, 1e-3, (200.0, 300.0))
        assert scipy.signal.lfilter(b, a, ramp)[-1] == pytest.approx(0.7)


def test_the_stated_law_is_replayed_to_its_rounding_and_a_wrong_filter_is_found(healthy):
    problem = healthy
    check = controller_check(problem)
    assert not check.wrong and not check.coarse
    assert np.all(check.replay_error < 0.35 * problem.law.resolution)
    b, a = velocity_estimate("two_corner", 1e-3, (120.0, 180.0))
    other = dataclasses.replace(problem.law, numerator=np.outer(b, np.ones(problem.n)),
                                denominator=np.outer(a, np.ones(problem.n)))
    logs = [dataclasses.replace(log, u=replay(other, log)) for log in problem.logs]
    foreign = dataclasses.replace(problem, fit=tuple(logs[:2]), held_out=tuple(logs[2:]))
    found = controller_check(foreign)
    assert found.wrong == tuple(range(problem.n))
    assert np.allclose(found.corners, [[120.0]] * 1 + [[180.0]], rtol=0.02)
