"""What gaps leave unknown: rows that do not count, and responses that a residual is free of."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.residual.noise import ORDER, rows_of
from clie_blocks.analysis.gap.residual.unknown_states import counted_rows, unlogged_pulse
from clie_blocks.analysis.gap.residual.whitening import residual_model
from clie_blocks.linear_filters import lfilter
from tests.gap.factories import make_log, make_problem

PERIOD = 0.001  # s
SAMPLES = 6000


class JointModel:
    """Inertia and damping of the joints."""

    def __init__(self, n):
        self.values = {"inertia": np.full(n, 0.5), "damping": np.full(n, 0.5)}


def make_log_with_gap(first, last, stride=1):
    """Log of a slow motion with noise, of which some ticks were lost."""
    time = PERIOD * np.arange(SAMPLES)[:, None]
    noise = 1e-4 * np.random.default_rng(1).standard_normal((SAMPLES, 1))
    measured = np.zeros(SAMPLES, bool)
    measured[::stride] = True
    measured[first:last] = False
    return dataclasses.replace(make_log(np.sin(time) + noise), measured=measured, stride=stride)


def make_uneven_log(seed=5, lost=0.02):
    """The same, with a row after one to three ticks, of which some were lost."""
    rng = np.random.default_rng(seed)
    ticks = np.cumsum(rng.choice([1, 2, 3], SAMPLES))
    measured = np.zeros(SAMPLES, bool)
    measured[ticks[(ticks < SAMPLES) & (rng.random(SAMPLES) >= lost)]] = measured[0] = True
    return dataclasses.replace(make_log_with_gap(0, 0), measured=measured)


def problem_of(*logs):
    problem = make_problem([np.zeros((SAMPLES, 1))] * len(logs), held_out=0, period=PERIOD)
    return problem.with_log_list(logs)


@pytest.fixture(scope="module")
def with_gap():
    """Residual model of a log with a gap of 50 ms at 3 s, and of the same log without."""
    problem = problem_of(make_log_with_gap(3000, 3050), make_log_with_gap(0, 0))
    return residual_model(problem, JointModel(1), METHOD)


def test_rows_of_a_gap_and_those_whose_whitening_reaches_it_do_not_count(with_gap):
    counted = counted_rows(with_gap.problem.logs[0], PERIOD)
    row = ORDER + np.arange(len(counted))  # of the log, in means of ten samples
    np.testing.assert_array_equal(counted, (row < 300) | (row > 304 + ORDER))
    assert counted_rows(make_log(np.zeros((SAMPLES, 1))), PERIOD) is None


def test_a_single_lost_sample_costs_no_row():
    assert counted_rows(make_log_with_gap(3004, 3005), PERIOD).all()


def test_what_does_not_count_is_zero_and_a_sample_less(with_gap):
    errors = with_gap.problem.logs[0].q
    whole, = with_gap.whitened(errors, 1)
    seen, = with_gap.whitened(errors, 0)
    counted = with_gap.counted[0]
    assert np.abs(seen[~counted]).max() < 1e-9 * np.abs(seen).max()
    assert with_gap.samples(whole, 1, 0) == len(whole)
    assert with_gap.samples(seen, 0, 0) == counted.sum() - 2  # speed and position behind the gap


@pytest.mark.parametrize("kick", [3020, 3049])
def test_a_residual_does_not_see_what_happened_in_a_gap(with_gap, kick):
    law, impulse = with_gap.problem.law, np.zeros((SAMPLES, 1))
    impulse[kick] = 5.0
    response = lfilter(*law.torque_sensitivity(0, 0.5, 0.5), impulse)
    white, = with_gap.whitened(response, 1)
    left, = with_gap.whitened(response, 0)
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(white)


def test_a_residual_sees_what_happened_outside_of_a_gap(with_gap):
    law, impulse = with_gap.problem.law, np.zeros((SAMPLES, 1))
    impulse[4000] = 5.0
    response = lfilter(*law.torque_sensitivity(0, 0.5, 0.5), impulse)
    white, = with_gap.whitened(response, 1)
    left, = with_gap.whitened(response, 0)
    assert np.linalg.norm(left) > 0.99 * np.linalg.norm(white)


def test_an_error_is_bridged_over_a_gap():
    log = make_log_with_gap(3000, 3050)
    error = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    wrong = error.copy()
    wrong[3000:3050] = 7.0
    np.testing.assert_allclose(log.bridged(wrong), error)


@pytest.mark.parametrize(("course", "least", "most"), [
    (lambda t: 0.0 * t + 1.0, 0.0, 1e-12),
    (lambda t: 3.0 * t, 0.0, 1e-9),
    (lambda t: np.sign(t - 2.9995), 1.9, np.inf),
    (lambda t: np.sign(t - 3.0005), 1.9, np.inf),
    (lambda t: np.sin(30.0 * t), 0.0, 1e-4)])
def test_a_pulse_may_be_missing_where_the_command_is_no_line(course, least, most):
    log = make_log_with_gap(3000, 3001)
    pulse = unlogged_pulse(course(PERIOD * np.arange(SAMPLES)), 2999, 3001, log)
    assert least <= pulse <= most


def test_a_slow_log_is_compared_at_its_own_samples():
    fast, slow = make_log_with_gap(0, 0), make_log_with_gap(0, 0, stride=20)
    assert rows_of(fast, PERIOD) == (1, 10) and rows_of(slow, PERIOD) == (20, 1)
    model = residual_model(problem_of(fast, slow), JointModel(1), METHOD)
    assert model.noise(0, 0) is model.noises[0] is not model.noise(1, 0)
    assert [len(model.whitened(log.q, j)[0]) for j, log in enumerate((fast, slow))] == [
        600 - ORDER, 300 - ORDER]


@pytest.mark.parametrize("stride", [2, 5, 20])
def test_noise_round_the_loop_is_white_in_the_rows_of_a_slow_log(stride):
    rng, length = np.random.default_rng(2), 400_000
    model = residual_model(problem_of(make_log_with_gap(0, 0, stride)), JointModel(1), METHOD)
    drawn = model.noise(0, 0).sigma * rng.standard_normal((length, 1))
    noise = lfilter(*model.problem.law.sensor_sensitivity(0, 0.5, 0.5), drawn)
    white = np.concatenate([model.whitened(part, 0)[0] for part in np.split(
        noise[:length - length % SAMPLES], length // SAMPLES)])
    assert np.mean(white**2) == pytest.approx(1.0, rel=0.06)


def test_rows_at_uneven_times_are_no_gaps():
    log = make_uneven_log(lost=0.0)
    assert (log.usual_step, log.gaps, log.shows_every_tick) == (3, [], False)
    assert counted_rows(log, PERIOD).all()
    lossy = make_uneven_log(lost=0.3)
    assert lossy.gaps
    assert all(behind - before > lossy.usual_step for before, behind in lossy.gaps)
    assert 0.2 < counted_rows(lossy, PERIOD).mean() < 1.0


def test_samples_of_uneven_rows_stand_for_the_ticks_up_to_the_next():
    log = make_uneven_log()
    values = np.arange(float(SAMPLES))
    held = log.at_samples(values)
    assert set(held) == set(log.sample_ticks) and np.all(held <= values)
    every = make_log_with_gap(3000, 3050)
    assert every.at_samples(values) is values


def test_a_step_between_uneven_rows_may_have_come_at_any_tick():
    log = make_uneven_log(lost=0.0)
    at = next(int(a) for a, b in zip(log.sample_ticks, log.sample_ticks[1:]) if b - a == 3)
    stepped = np.zeros((SAMPLES, 1))
    stepped[at + 3:] = 0.1
    model = residual_model(problem_of(dataclasses.replace(log, q_d=stepped)), JointModel(1),
                           METHOD)
    still = residual_model(problem_of(dataclasses.replace(log, q_d=0.0 * stepped)), JointModel(1),
                           METHOD)
    assert (model.initial_responses[0][0].shape[1]
            == still.initial_responses[0][0].shape[1] + 1)


@pytest.mark.parametrize("lost", [0.0, 0.02])
def test_noise_round_the_loop_is_white_in_uneven_rows(lost):
    rng, log = np.random.default_rng(2), make_uneven_log(lost=lost)
    model = residual_model(problem_of(log), JointModel(1), METHOD)
    assert model.noise(0, 0).sigma == pytest.approx(1e-4, rel=0.03)
    white, runs = [], 60
    for _ in range(runs):
        drawn = 1e-4 * rng.standard_normal((SAMPLES, 1))
        noise = lfilter(*model.problem.law.sensor_sensitivity(0, 0.5, 0.5), drawn)
        white.append(model.whitened(log.bridged(noise), 0)[0])
    counts = model.samples(white[0], 0, 0)
    assert np.sum(np.square(white)) / (runs * counts) == pytest.approx(1.0, rel=0.12)
