"""Gain, lag and delay between commanded and measured torque."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.torque_path import describe, path_torque, torque_paths
from clie_blocks.analysis.records import Record
from clie_blocks.errors import NotIdentifiableError

TIME = 0.002 * np.arange(3000)


def record(**signals):
    return Record(time=TIME, q=np.zeros((TIME.size, 2)), joints=("a", "b"), **signals)


def test_a_known_path_is_identified():
    noise = np.random.default_rng(1).normal(0, 0.01, TIME.size)
    u = np.sin(2 * np.pi * (0.2 + 0.4 * TIME) * TIME)
    tau = path_torque(u, 0.002, 0.8, 0.02, 0.006, 0.05) + noise
    still = np.zeros_like(u)
    (path,) = torque_paths(record(u=np.stack([u, still], 1), tau=np.stack([tau, still], 1)))
    assert path.joint == "a" and path.gain == pytest.approx(0.8, abs=0.01)
    assert path.total_delay == pytest.approx(0.026, abs=5e-4)
    assert path.offset == pytest.approx(0.05, abs=2e-3)
    assert path.unexplained == pytest.approx(0.01 / np.std(tau), rel=0.05)


def test_lag_follows_its_differential_equation():
    step = path_torque(np.ones(200), 1e-3, 2.0, 0.05, 0.0, 0.0)
    np.testing.assert_allclose(step, 2.0 * (1 - np.exp(-1e-3 * np.arange(1, 201) / 0.05)))


def test_a_missing_torque_or_an_idle_drive_is_refused():
    with pytest.raises(NotIdentifiableError, match="commanded and the measured"):
        torque_paths(record(u=np.ones((TIME.size, 2))))
    still = np.zeros((TIME.size, 2))
    with pytest.raises(NotIdentifiableError, match="no joint is driven"):
        torque_paths(record(u=still, tau=still))


def test_a_path_is_described_where_both_torques_are_logged():
    u = np.sin(2 * np.pi * (0.2 + 0.4 * TIME) * TIME)
    still = np.zeros_like(u)
    both = np.stack([u, still], 1)
    tau = np.stack([path_torque(u, 0.002, 0.8, 0.02, 0.006, 0.0), still], 1)
    (sentence,) = describe(record(u=both, tau=tau))
    assert "a: the measured torque is 0.80 times the command, with a delay of 26 ms" in sentence
    assert describe(record(u=both)) == [] == describe(record(u=0 * both, tau=0 * both))
