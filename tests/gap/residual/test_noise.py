"""Noise of the loop: what whitening must leave."""

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise
from clie_blocks.analysis.gap.residual.noise import (
    decimated,
    sensor_noise_model,
    whiten,
)
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses


def test_noise_round_the_loop_is_whitened_to_unit_variance(healthy):
    problem = healthy
    inertia, damping = problem.nominal.inertia, problem.nominal.damping
    sensitivity = problem.law.sensor_sensitivity(0, inertia[0], damping[0])
    found = sensor_noise_model(problem, 0, noise_responses(problem, 0, inertia, damping))
    drawn = found.sigma * np.random.default_rng(1).standard_normal(400_000)
    left = whiten(decimated(lfilter(*sensitivity, drawn), problem.period), found.whitener)
    assert np.mean(left**2) == pytest.approx(1.0, rel=0.03)
    correlation = [np.mean(left[lag:] * left[:-lag]) for lag in (1, 2, 5, 10)]
    assert np.max(np.abs(correlation)) < 0.03
    assert found.floor == pytest.approx(np.std(lfilter(*sensitivity, drawn)), rel=0.02)


def test_a_healthy_robot_leaves_noise_alone(healthy):
    problem = healthy
    _, nominal = fit_nominal(problem, METHOD)
    assert np.all(nominal.chi2 / nominal.samples < 1.35)
    assert nominal.penalty == pytest.approx(0.0, abs=1.0)
    assert sensor_noise(problem, 0) > 0.0


@pytest.mark.parametrize("shape", [(500,), (496, 3), (37, 2, 2)])
def test_whitening_in_blocks_is_the_filter_itself(shape):
    rng = np.random.default_rng(5)
    x, whitener = rng.standard_normal(shape), rng.standard_normal(21)
    filtered = lfilter(whitener, [1.0], x, axis=0)[20:]
    np.testing.assert_allclose(whiten(x, whitener), filtered, atol=1e-12)
