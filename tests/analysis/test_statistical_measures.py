import numpy as np
import pytest

from clie_blocks.analysis.statistical_measures import (
    NORMAL_95,
    bonett_price,
    bootstrap,
    brier,
    calibration_error,
    wilson,
)


@pytest.mark.parametrize(("hits", "count", "interval"), [
    (13, 14, (0.6853, 0.9873)), (0, 38, (0.0, 0.0918)), (14, 14, (0.7847, 1.0))])
def test_wilson_matches_its_closed_form(hits, count, interval):
    z, p = 1.959963984540054, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + (z / (2 * count)) ** 2) / (1 + z * z / count)
    assert wilson(hits, count) == pytest.approx((middle - half, middle + half), abs=1e-12)
    assert wilson(hits, count) == pytest.approx(interval, abs=1e-4)


def test_the_difference_of_two_shares_covers_its_truth():
    """1000 studies of 60 trials in which the methods succeed with 0.8 and 0.7, often together."""
    rng = np.random.default_rng(1)
    covered = 0
    for _ in range(1000):
        easy = rng.random(60)
        low, high = bonett_price(list(zip(easy < 0.8, easy + 0.05 * rng.normal(size=60) < 0.7)))
        covered += low <= 0.1 <= high
    assert 0.93 < covered / 1000 <= 0.99


def test_two_methods_that_always_agree_differ_by_nothing_within_an_interval():
    low, high = bonett_price([(True, True)] * 98)
    assert low == pytest.approx(-high)
    assert high == pytest.approx(1.959964 * np.sqrt(2 / 100 / 100), rel=1e-6)


def test_a_bootstrapped_mean_has_the_interval_of_the_normal_distribution():
    rows = np.random.default_rng(2).normal(5.0, 2.0, 400)
    low, high = bootstrap(rows, np.mean)
    assert (high - low) / 2 == pytest.approx(NORMAL_95 * rows.std() / 20, rel=0.1)
    assert (high + low) / 2 == pytest.approx(rows.mean(), abs=0.02)
    assert bootstrap(rows, np.mean) == (low, high)  # the same every time
    assert bootstrap([3.0], np.median) == (3.0, 3.0)


def test_scores_of_stated_probabilities():
    assert brier([(0.9, True), (0.4, False)]) == pytest.approx((0.01 + 0.16) / 2)
    assert calibration_error([(0.75, True)] * 3 + [(0.75, False)]) == pytest.approx(0.0)
    assert calibration_error([(0.9, False)] * 4) == pytest.approx(0.9)
    assert calibration_error([(1.0, True)]) == 0.0
    assert calibration_error([(0.61, True), (0.79, False)], bins=2) == pytest.approx(0.2)
