"""Variance components against the analysis of variance, and what they promise over many fleets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.gap.fleet.variation import components, odd_units, variation

UNITS, LOGS, SPREAD = 6, 4, 0.05


def fleet(rng, tau, omega, units=UNITS, logs=LOGS, spread=SPREAD, mean=2.0):
    values = mean + tau * rng.normal(size=(units, 1)) + omega * rng.normal(size=(units, logs))
    deviation = np.full((units, logs), spread)
    return list(zip(values + deviation * rng.normal(size=(units, logs)), deviation))


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_of_balanced_logs_they_are_those_of_the_analysis_of_variance(seed):
    """Within: omega^2 + s^2; between: logs times tau^2 more, where both are positive."""
    estimates = fleet(np.random.default_rng(seed), 1.0, 0.5)
    y = np.array([values for values, _ in estimates])
    within = np.sum((y - y.mean(axis=1, keepdims=True)) ** 2) / (UNITS * (LOGS - 1))
    between = LOGS * np.var(y.mean(axis=1), ddof=1)
    tau, omega = components(estimates)
    if within > 2 * SPREAD**2 and between > 1.2 * within:
        assert omega**2 + SPREAD**2 == pytest.approx(within, rel=1e-3)
        assert tau**2 == pytest.approx((between - within) / LOGS, rel=1e-2)


@settings(max_examples=10)
@given(st.floats(0.01, 100.0), st.floats(-50.0, 50.0))
def test_another_unit_and_zero_of_the_parameter_change_nothing(scale, shift):
    estimates = fleet(np.random.default_rng(3), 1.0, 0.5)
    other = [(scale * (y + shift), scale * s) for y, s in estimates]
    one, two = variation(estimates), variation(other)
    assert two.mean == pytest.approx(scale * (one.mean + shift), rel=1e-3, abs=1e-2 * scale)
    assert two.between_units == pytest.approx(scale * one.between_units, rel=2e-2)
    for found in (one, two):
        assert found.units_differ and found.logs_differ


def test_logs_that_agree_have_no_variance_beyond_their_fits():
    estimates = [(np.full(LOGS, 2.0), np.full(LOGS, SPREAD)) for _ in range(UNITS)]
    found = variation(estimates)
    assert found.between_units == found.between_logs == 0.0
    assert not (found.units_differ or found.logs_differ) and odd_units([found]) == [[]]


def test_one_unit_has_no_others_and_one_log_no_repeats():
    alone = variation(fleet(np.random.default_rng(0), 1.0, 0.0, units=1))
    assert np.isnan(alone.half) and np.isnan(alone.units[0].p)
    once = variation(fleet(np.random.default_rng(0), 1.0, 0.0, logs=1))
    assert once.between_logs == 0.0 and np.isnan(once.units[0].repeat)


def test_a_worn_unit_is_odd_and_the_others_are_not():
    estimates = fleet(np.random.default_rng(1), 0.1, 0.1)
    y, s = estimates[2]
    estimates[2] = y + 2.0, s
    assert odd_units([variation(estimates)]) == [[2]]


@pytest.mark.slow
@pytest.mark.parametrize("units, logs, tau, omega", [
    (4, 3, 1.0, 0.0), (6, 3, 1.0, 0.5), (5, 3, 0.0, 1.0)])
def test_intervals_cover_and_false_alarms_are_as_rare_as_said(units, logs, tau, omega):
    rng, count = np.random.default_rng(units), 100
    means = alarms = 0
    repeats = []
    for _ in range(count):
        spread = rng.uniform(0.1, 0.6)
        truth = 10.0 + tau * rng.normal(size=units)
        estimates = [(one + np.hypot(omega, spread) * rng.normal(size=logs), np.full(logs, spread))
                     for one in truth]
        found = variation(estimates)
        means += abs(found.mean - 10.0) <= found.half
        alarms += bool(odd_units([found])[0])
        again = truth + np.hypot(omega, spread) * rng.normal(size=units)
        repeats += [abs(new - unit.value) <= unit.repeat
                    for new, unit in zip(again, found.units)]
    error = 3 * np.sqrt(0.05 * 0.95 / count)
    assert means / count > 0.95 - error
    assert alarms / count < 0.05 + error
    assert 0.92 < np.mean(repeats) < 0.99
