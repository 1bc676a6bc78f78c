"""Intervals that hold under coloured residuals, and instruments that remove the bias of noise."""

import numpy as np
import pytest
from scipy import signal, stats

from clie_blocks.analysis.records.uncertainty import least_squares, quantile95


def coloured(random, size, memory=0.98):
    return signal.lfilter([np.sqrt(1 - memory**2)], [1, -memory], random.standard_normal(size))


def test_the_interval_covers_the_truth_where_that_of_white_noise_does_not():
    random, hits, naive = np.random.default_rng(3), 0, 0
    trials, size = 200, 6000
    for _ in range(trials):
        x = np.column_stack((coloured(random, size), np.ones(size)))
        y = x @ [2.0, 0.5] + coloured(random, size)
        fit = least_squares(x, y)
        hits += abs(fit.value[0] - 2.0) < fit.interval[0]
        white = 1.96 * np.sqrt(np.var(fit.residual) * np.linalg.inv(x.T @ x)[0, 0])
        naive += abs(fit.value[0] - 2.0) < white
    assert 0.90 <= hits / trials <= 0.99
    assert naive / trials < 0.4


def test_instruments_remove_the_bias_of_noise_in_the_regressor():
    random = np.random.default_rng(4)
    true = random.standard_normal(20_000)
    seen = true + 0.7 * random.standard_normal(true.size)
    target = 3.0 * true + 0.1 * random.standard_normal(true.size)
    plain = least_squares(seen[:, None], target)
    clean = least_squares(seen[:, None], target, true[:, None])
    assert plain.value[0] == pytest.approx(3.0 / 1.49, rel=0.02)
    assert abs(clean.value[0] - 3.0) < 1.5 * clean.interval[0] < 0.1


def test_scaling_a_column_scales_its_estimate_and_interval():
    random = np.random.default_rng(5)
    x = random.standard_normal((3000, 2))
    y = x @ [1.0, -2.0] + random.standard_normal(3000)
    one, other = least_squares(x, y), least_squares(x * [1e6, 1e-6], y)
    assert np.allclose(one.value, other.value * [1e6, 1e-6])
    assert np.allclose(one.interval, other.interval * [1e6, 1e-6])


@pytest.mark.parametrize("freedom", [10, 29, 100])
def test_the_quantile_is_that_of_student(freedom):
    assert quantile95(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), rel=0.01)
