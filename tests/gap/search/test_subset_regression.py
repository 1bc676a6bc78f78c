"""Regression within bounds, from normal equations, against scipy's on the rows themselves."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from clie_blocks.analysis.gap.search.subset_regression import bounded_drops, regression

LOWER = st.sampled_from([-np.inf, -2.0, -0.3, 0.0])
UPPER = st.sampled_from([0.2, 1.0, 3.0, np.inf])


def column_set(data, lower=(), upper=()):
    """Columns of one probe, as far as the regression looks at them."""
    return SimpleNamespace(data=data, amplitudes=("",) * len(lower),
                           limits=np.array([lower, upper]))


def bounded_drop(gram, right, lower, upper):
    """Drop and coefficients of one regression."""
    (drop,), (theta,) = bounded_drops(gram[None], right[None], lower[None], upper[None])
    return drop, theta


def expected(data, target, lower, upper):
    """Drop of the sum of squares, and the coefficients, by scipy."""
    solution = lsq_linear(data, target, (lower, upper), method="bvls", tol=1e-14)
    rest = target - data @ solution.x
    return target @ target - rest @ rest, solution.x


@given(seed=st.integers(0, 2**32 - 1), alike=st.floats(0.0, 0.99), sizes=st.floats(1e-3, 1e3),
       bounds=st.lists(st.tuples(LOWER, UPPER), min_size=1, max_size=4))
def test_it_is_the_optimum_within_the_bounds(seed, alike, sizes, bounds):
    rng = np.random.default_rng(seed)
    lower, upper = np.array(bounds).T / sizes
    data = rng.normal(size=(60, len(bounds))) + alike / (1.0 - alike) * rng.normal(size=(60, 1))
    data *= sizes
    target = data @ rng.normal(scale=2.0 / sizes, size=len(bounds)) + rng.normal(size=60)
    drop, theta = bounded_drop(data.T @ data, data.T @ target, lower, upper)
    best, _ = expected(data, target, lower, upper)
    assert np.all((theta >= lower - 1e-12 / sizes) & (theta <= upper + 1e-12 / sizes))
    rest = target - data @ theta
    assert drop == pytest.approx(target @ target - rest @ rest, rel=1e-6, abs=1e-6)
    assert drop == pytest.approx(best, rel=1e-4, abs=1e-4)
    assert drop <= best + 1e-9 * (1.0 + best)


def test_a_bound_on_one_column_leaves_the_other_free():
    rng = np.random.default_rng(1)
    common = rng.normal(size=100)
    data = np.stack([common, 0.8 * common + 0.6 * rng.normal(size=100)], axis=1)
    target = data @ [3.0, 1.0]
    lower, upper = np.zeros(2), np.array([1.0, np.inf])
    drop, theta = bounded_drop(data.T @ data, data.T @ target, lower, upper)
    best, solution = expected(data, target, lower, upper)
    assert theta == pytest.approx(solution, rel=1e-4)
    assert theta[0] == 1.0 and theta[1] > 2.0
    assert drop == pytest.approx(best, rel=1e-6)


def test_columns_that_are_the_same_share_what_they_explain():
    data = np.ones((10, 2))
    drop, theta = bounded_drop(data.T @ data, data.T @ np.full(10, 4.0), np.zeros(2),
                               np.full(2, np.inf))
    assert theta == pytest.approx([2.0, 2.0], rel=1e-5)
    assert drop == pytest.approx(160.0, rel=1e-5)


def test_what_points_the_other_way_explains_nothing():
    data = np.ones((10, 1))
    drop, theta = bounded_drop(data.T @ data, data.T @ np.full(10, -4.0), np.zeros(1),
                               np.array([np.inf]))
    assert drop == 0.0 and theta[0] == 0.0


def test_a_set_without_amplitudes_counts_as_it_is_and_the_others_explain_the_rest():
    rng = np.random.default_rng(3)
    data = rng.normal(size=(80, 3))
    target = data @ [1.0, 0.5, 3.0]
    sets = [column_set(data[:, :1]), column_set(data[:, 1:], [-1.0, -1.0], [1.0, 1.0])]
    together, alone = regression(sets, target).gains([[0, 1], [0]])
    best, solution = expected(data[:, 1:], target - data[:, 0], -1.0, 1.0)
    assert together.theta[0] == () and together.theta[1] == pytest.approx(solution, rel=1e-4)
    before, after = target @ target, (target - data[:, 0]) @ (target - data[:, 0])
    assert together.drop == pytest.approx(before - after + best, rel=1e-6)
    assert together.drop > alone.drop


def test_many_regressions_are_what_each_is_alone():
    rng = np.random.default_rng(4)
    data = rng.normal(size=(50, 20, 3))
    target = (data @ rng.normal(scale=2.0, size=(50, 3, 1)))[..., 0]
    gram, right = data.transpose(0, 2, 1) @ data, (target[:, None] @ data)[:, 0]
    lower, upper = np.full((50, 3), -0.5), np.where(rng.random((50, 3)) < 0.5, 1.0, np.inf)
    drops, thetas = bounded_drops(gram, right, lower, upper)
    for i in range(50):
        drop, theta = bounded_drop(gram[i], right[i], lower[i], upper[i])
        assert drops[i] == pytest.approx(drop, rel=1e-9)
        assert thetas[i] == pytest.approx(theta, rel=1e-9, abs=1e-12)
