"""Dead time, lag and delay between goal and motion of a servo."""

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


def record(goal, q):
    return Record(time=PERIOD * np.arange(goal.size), q=q[:, None], qd=goal[:, None])


@pytest.fixture(scope="module")
def goal():
    return np.repeat(np.random.default_rng(2).uniform(-0.5, 0.5, 40), 40)


def test_a_known_servo_is_found(goal):
    q = servo_response(goal, goal[0], PERIOD, 25.0, 1.2, 0.01, 0.035)
    q = q + np.random.default_rng(3).normal(0, 1e-3, q.size)
    found = fit_position_path(record(goal, q), 0)
    assert found.frequency == pytest.approx(25.0, rel=0.03)
    assert found.damping_ratio == pytest.approx(1.2, rel=0.03)
    assert found.delay == pytest.approx(0.035, abs=1e-3)
    assert found.rms_error == pytest.approx(1e-3, rel=0.1)
    assert fit_position_path(record(goal, q), 0, ()).rms_error > 3 * found.rms_error


def test_dead_time_counts_lag_and_delay(goal):
    ideal = np.concatenate([np.repeat(goal[:1], 3), goal[:-3]])
    assert np.median(dead_times(record(goal, ideal), 0)) == pytest.approx(0.06)
    slow = servo_response(goal, goal[0], PERIOD, 25.0, 1.0, 0.0, 0.0)
    assert np.median(dead_times(record(goal, slow), 0)) == pytest.approx(PERIOD)


def test_a_goal_at_rest_tells_nothing(goal):
    with pytest.raises(NotIdentifiableError, match="never moves"):
        fit_position_path(record(0 * goal, goal), 0)


def second_route(goal, delay, level, period=PERIOD, fine=200):
    """The same servo by plain small steps: held while friction can hold it."""
    h, q, dq, frequency, damping = period / fine, goal[0], 0.0, 25.0, 1.2
    late, out = round(delay / h), []
    for i in range(len(goal) * fine):
        if i % fine == 0:
            out.append(q)
        pull = frequency**2 * (goal[max(i - late, 0) // fine] - q) - 2 * damping * frequency * dq
        free = dq + h * pull
        hold = h * frequency**2 * level
        dq = free - min(max(free, -hold), hold)
        q += h * dq
    return np.array(out)


def test_the_servo_with_dry_friction_agrees_with_small_steps(goal):
    mine = servo_response(goal[:200], goal[0], PERIOD, 25.0, 1.2, 0.0, 0.0, 0.02)
    assert np.abs(mine - second_route(goal[:200], 0.0, 0.02)).max() < 2e-3


@pytest.mark.parametrize("delay, level, cause", [
    (0.03, 0.0, "setpoint_delay"), (0.0, 0.02, "coulomb"), (0.03, 0.02, "both")])
def test_a_late_goal_and_dry_friction_are_told_apart(delay, level, cause, goal):
    rng = np.random.default_rng(4)
    logs = [record(moved, second_route(moved, delay, level) + rng.normal(0, 5e-4, moved.size))
            for moved in (goal[:600], goal[800:1400])]
    found = error_by_hypothesis(*logs, 0)
    path, left = found[cause]
    assert path.delay == pytest.approx(delay, abs=1.5e-3)
    assert path.level == pytest.approx(level, abs=1e-3)
    assert left < 1.5e-3
    simpler = {"setpoint_delay": ("lag", "coulomb"), "coulomb": ("lag", "setpoint_delay"),
               "both": ("lag", "setpoint_delay", "coulomb")}[cause]
    assert all(found[name][1] > 1.5 * left for name in simpler)


def test_intervals_hold_the_truth_and_the_sentence_parts_the_dead_time(goal):
    rng, within = np.random.default_rng(5), []
    clean = servo_response(goal, goal[0], PERIOD, 25.0, 1.2, 0.0, 0.035, 0.01)
    for _ in range(3):
        found = fit_position_path(record(goal, clean + rng.normal(0, 1e-3, clean.size)), 0,
                          ("delay", "level"))
        for name, truth in (("delay", 0.035), ("level", 0.01), ("frequency", 25.0)):
            assert 0.0 < found.half_widths[name] < 0.2 * truth
            within.append(abs(getattr(found, name) - truth) < 1.5 * found.half_widths[name])
    assert all(within)
    said = describe(record(goal, clean), 0)
    late = 1e3 * np.median(dead_times(record(goal, clean), 0))
    assert "the delay of the set-points is 35 +- " in said and "up to 10 +- " in said
    assert f"dead time is {late + 20:.0f} ms" in said and f"({late:.0f} ms from the sample" in said
