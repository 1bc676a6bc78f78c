"""Dead time, lag and delay between set-point and motion of a servo."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.position_path import (
    dead_times,
    describe,
    error_by_hypothesis,
    fit_position_path,
    servo_response,
)
from clie_blocks.analysis.records import Record
from clie_blocks.errors import NotIdentifiableError

PERIOD = 0.02


def record(set_point, q):
    return Record(time=PERIOD * np.arange(set_point.size), q=q[:, None], qd=set_point[:, None])


@pytest.fixture(scope="module")
def set_point():
    return np.repeat(np.random.default_rng(2).uniform(-0.5, 0.5, 40), 40)


def test_a_known_servo_is_identified(set_point):
    q = servo_response(set_point, set_point[0], PERIOD, 25.0, 1.2, 0.01, 0.035)
    q = q + np.random.default_rng(3).normal(0, 1e-3, q.size)
    path = fit_position_path(record(set_point, q), 0)
    assert path.frequency == pytest.approx(25.0, rel=0.03)
    assert path.damping_ratio == pytest.approx(1.2, rel=0.03)
    assert path.delay == pytest.approx(0.035, abs=1e-3)
    assert path.rms_error == pytest.approx(1e-3, rel=0.1)
    assert fit_position_path(record(set_point, q), 0, ()).rms_error > 3 * path.rms_error


def test_dead_time_counts_lag_and_delay(set_point):
    ideal = np.concatenate([np.repeat(set_point[:1], 3), set_point[:-3]])
    assert np.median(dead_times(record(set_point, ideal), 0)) == pytest.approx(0.06)
    slow = servo_response(set_point, set_point[0], PERIOD, 25.0, 1.0, 0.0, 0.0)
    assert np.median(dead_times(record(set_point, slow), 0)) == pytest.approx(PERIOD)


def test_a_set_point_at_rest_identifies_nothing(set_point):
    with pytest.raises(NotIdentifiableError, match="never moves"):
        fit_position_path(record(0 * set_point, set_point), 0)


def second_route(set_point, delay, level, period=PERIOD, fine=200):
    """The same servo by plain small steps: held while friction can hold it."""
    h, q, dq, frequency, damping = period / fine, set_point[0], 0.0, 25.0, 1.2
    delay_steps, positions = round(delay / h), []
    for i in range(len(set_point) * fine):
        if i % fine == 0:
            positions.append(q)
        error = set_point[max(i - delay_steps, 0) // fine] - q
        pull = frequency**2 * error - 2 * damping * frequency * dq
        free = dq + h * pull
        hold = h * frequency**2 * level
        dq = free - min(max(free, -hold), hold)
        q += h * dq
    return np.array(positions)


def test_the_servo_with_dry_friction_agrees_with_small_steps(set_point):
    response = servo_response(set_point[:200], set_point[0], PERIOD, 25.0, 1.2, 0.0, 0.0, 0.02)
    assert np.abs(response - second_route(set_point[:200], 0.0, 0.02)).max() < 2e-3


@pytest.mark.parametrize("delay, level, cause", [
    (0.03, 0.0, "setpoint_delay"), (0.0, 0.02, "coulomb"), (0.03, 0.02, "both")])
def test_delay_and_dry_friction_are_distinguished(delay, level, cause, set_point):
    rng = np.random.default_rng(4)
    logs = [record(moved, second_route(moved, delay, level) + rng.normal(0, 5e-4, moved.size))
            for moved in (set_point[:600], set_point[800:1400])]
    by_hypothesis = error_by_hypothesis(*logs, 0)
    path, error = by_hypothesis[cause]
    assert path.delay == pytest.approx(delay, abs=1.5e-3)
    assert path.level == pytest.approx(level, abs=1e-3)
    assert error < 1.5e-3
    simpler = {"setpoint_delay": ("lag", "coulomb"), "coulomb": ("lag", "setpoint_delay"),
               "both": ("lag", "setpoint_delay", "coulomb")}[cause]
    assert all(by_hypothesis[name][1] > 1.5 * error for name in simpler)


def test_intervals_contain_the_truth_and_the_sentence_states_the_dead_time(set_point):
    rng, covered = np.random.default_rng(5), []
    clean = servo_response(set_point, set_point[0], PERIOD, 25.0, 1.2, 0.0, 0.035, 0.01)
    for _ in range(3):
        noisy = clean + rng.normal(0, 1e-3, clean.size)
        path = fit_position_path(record(set_point, noisy), 0, ("delay", "level"))
        for name, truth in (("delay", 0.035), ("level", 0.01), ("frequency", 25.0)):
            assert 0.0 < path.half_widths[name] < 0.2 * truth
            covered.append(abs(getattr(path, name) - truth) < 1.5 * path.half_widths[name])
    assert all(covered)
    sentence = describe(record(set_point, clean), 0)
    dead_time = 1e3 * np.median(dead_times(record(set_point, clean), 0))
    assert "the delay of the set-points is 35 +- " in sentence and "up to 10 +- " in sentence
    assert f"dead time is {dead_time + 20:.0f} ms" in sentence
    assert f"({dead_time:.0f} ms from the sample" in sentence


def test_a_log_without_set_points_is_refused():
    with pytest.raises(NotIdentifiableError, match="no set-point qd"):
        fit_position_path(Record(time=PERIOD * np.arange(500), q=np.zeros((500, 1))), 0)


def test_a_weight_and_a_course_of_its_own_are_those_of_small_steps(set_point):
    """A weight that grows with the angle acts as a softer spring; a course limits the aim."""
    asked = set_point[:200]
    sagging = servo_response(asked, asked[0], PERIOD, 25.0, 1.2, 0.01, 0.0, sag=0.3)
    settled = np.flatnonzero(np.diff(asked))  # the samples before each step
    np.testing.assert_allclose(sagging[settled[1:]] * 0.7, asked[settled[1:]] + 0.01, atol=2e-3)
    slow = servo_response(asked, asked[0], PERIOD, 200.0, 1.0, 0.0, 0.0, rate=1.0)
    assert np.abs(np.diff(slow)).max() == pytest.approx(PERIOD * 1.0, rel=0.05)
    soft = servo_response(asked, asked[0], PERIOD, 200.0, 1.0, 0.0, 0.0, ramp=1 / 20.0)
    assert np.abs(np.diff(soft, 2)).max() < 1.3 * 20.0 * PERIOD**2
    np.testing.assert_allclose(soft[settled[1:]], asked[settled[1:]], atol=5e-3)
