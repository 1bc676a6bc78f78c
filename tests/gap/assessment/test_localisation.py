"""Where the gap lies: shares of the error beyond what sensor noise alone leaves."""

import dataclasses

import numpy as np
import pytest
from factories import Missing, make_check, make_fit, make_problem, make_residual_model
from scipy.signal import lfilter

from clie_blocks.analysis.gap.assessment.localisation import BANDS, localise

SIGMA, PERIOD, SAMPLES = 1e-4, 0.01, 20_000
TIME = PERIOD * np.arange(SAMPLES)
COLOUR = np.array([1.0, -0.9])  # the noise is low-pass, as in a loop
COURSE = np.sin(0.3 * TIME)
TONE = np.sin(2 * np.pi * 2.0 * TIME)


def located(error):
    """Map of a gap that is coloured sensor noise and a stated error [rad]."""
    noise = lfilter([SIGMA], COLOUR, np.random.default_rng(5).standard_normal(SAMPLES))
    problem = make_problem([COURSE[:, None]], held_out=0)
    residuals = make_residual_model(problem, SIGMA, whitener=COLOUR / SIGMA)
    nominal = make_fit(problem)
    missing = Missing(problem, (), nominal.hypothesis.values, (noise + error)[:, None])
    return localise(residuals, dataclasses.replace(nominal, hypothesis=missing), make_check())


def shares(where):
    """Every list of shares of a map."""
    yield [row["share"] for row in where["joint"]]
    yield [row["share"] for row in where["frequency"]]
    yield from (row["share"] for row in where["time"])
    for row in where["region"]:
        yield from (row[key]["share"] for key in ("position", "velocity", "speed", "torque"))


def test_a_tone_as_large_as_the_noise_has_its_band_to_itself():
    where = located(3e-4 * TONE)
    share = {tuple(row["band_hz"]): row["share"] for row in where["frequency"]}
    assert share[1.0, 3.0] > 0.9
    assert list(share) == list(BANDS)


def test_an_error_in_one_quarter_of_the_travel_is_found_there_and_in_its_time():
    top = np.quantile(COURSE, 0.75)
    where = located(np.where(COURSE > top, 2e-4 * TONE, 0.0))
    assert where["region"][0]["position"]["share"][3] > 0.9
    where = located(np.where(TIME < 20.0, 1e-3 * TONE, 0.0))
    assert where["time"][0]["share"][0] > 0.9


@pytest.mark.parametrize("size", [0.0, 1e-5, 3e-4, 1.0])
def test_shares_are_never_negative_and_sum_to_one_or_are_all_zero(size):
    for row in shares(located(size * TONE)):
        assert min(row) >= 0.0
        assert sum(row) == pytest.approx(1.0) or not any(row)


def test_what_lies_below_the_noise_has_no_share():
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    where = located(-0.5 * lfilter([SIGMA], COLOUR, noise))  # half of the expected noise
    assert not any(any(row) for row in shares(where))
