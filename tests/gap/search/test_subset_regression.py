"""Regression with signs and bounds, from normal equations."""

import numpy as np
import pytest
from scipy.optimize import nnls

from clie_blocks.analysis.gap.search.subset_regression import bounded_drop


def test_it_is_least_squares_with_signs():
    rng = np.random.default_rng(0)
    for _ in range(20):
        data, target = rng.normal(size=(50, 3)), rng.normal(size=50)
        drop, theta = bounded_drop(data.T @ data, data.T @ target, np.zeros(3), np.full(3, np.inf))
        expected, left = nnls(data, target)
        assert np.allclose(theta, expected, atol=1e-5)
        assert drop == pytest.approx(target @ target - left**2, rel=1e-4, abs=1e-9)


def test_bounds_draw_a_solution_in():
    data = np.eye(4)[:, :2]
    drop, theta = bounded_drop(data.T @ data, data.T @ np.array([10.0, 1.0, 0, 0]),
                          np.array([-2.0, -2.0]), np.array([2.0, 2.0]))
    assert np.abs(theta).max() == pytest.approx(2.0)
    assert 0.0 < drop < 101.0
