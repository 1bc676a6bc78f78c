"""Dead time, lag and delay between goal and motion of a servo."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.goal_path import dead_times, followed, goal_path
from clie_blocks.analysis.records import Record
from clie_blocks.errors import NotIdentifiableError

PERIOD = 0.02


def record(goal, q):
    return Record(time=PERIOD * np.arange(goal.size), q=q[:, None], qd=goal[:, None])


@pytest.fixture(scope="module")
def goal():
    return np.repeat(np.random.default_rng(2).uniform(-0.5, 0.5, 40), 40)


def test_a_known_servo_is_found(goal):
    q = followed(goal, goal[0], PERIOD, 25.0, 1.2, 0.01, 0.035)
    q = q + np.random.default_rng(3).normal(0, 1e-3, q.size)
    found = goal_path(record(goal, q), 0)
    assert found.frequency == pytest.approx(25.0, rel=0.03)
    assert found.damping_ratio == pytest.approx(1.2, rel=0.03)
    assert found.delay == pytest.approx(0.035, abs=1e-3)
    assert found.left == pytest.approx(1e-3, rel=0.1)
    assert goal_path(record(goal, q), 0, delayed=False).left > 3 * found.left


def test_dead_time_counts_lag_and_delay(goal):
    ideal = np.concatenate([np.repeat(goal[:1], 3), goal[:-3]])
    assert np.median(dead_times(record(goal, ideal), 0)) == pytest.approx(0.06)
    slow = followed(goal, goal[0], PERIOD, 25.0, 1.0, 0.0, 0.0)
    assert np.median(dead_times(record(goal, slow), 0)) == pytest.approx(PERIOD)


def test_a_goal_at_rest_tells_nothing(goal):
    with pytest.raises(NotIdentifiableError, match="never moves"):
        goal_path(record(0 * goal, goal), 0)
