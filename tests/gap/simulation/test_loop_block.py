"""The block of the sampled loop: its initial state, and the memory of its velocity filter."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.records.velocity_filter import velocity_filter
from clie_blocks.robot_loop.block import ramp_memory

PERIOD = 1e-3  # s


@pytest.mark.parametrize("kind", ["tustin", "zoh", "backward", "matched"])
def test_the_memory_is_that_of_a_filter_that_has_always_run(kind):
    b, a = velocity_filter(kind, PERIOD, (200.0, 300.0))
    past = 0.7 * PERIOD * np.arange(-2000, 0)
    memory = lfilter(b, a, past, zi=np.zeros(2))[1]
    assert ramp_memory(np.array([0.7]), b[:, None], a[:, None], PERIOD) == pytest.approx(
        memory, rel=1e-6)


def test_a_law_without_velocity_has_no_memory():
    b, a = velocity_filter("none", PERIOD)
    assert not ramp_memory(np.array([0.7]), b[:, None], a[:, None], PERIOD).any()


def test_a_log_that_begins_in_motion_starts_with_its_velocity(healthy):
    hypothesis, log = build_hypothesis(healthy, ()), healthy.logs[0]
    simulator = hypothesis.simulator
    moving = dataclasses.replace(log, start=log.q[100], speed=0.3 * np.ones(healthy.n))
    state = simulator.block.layout.unpack(
        simulator.initial_state(moving, moving.start, hypothesis.of_log(0)))
    np.testing.assert_array_equal(state["q"][0], log.q[100])
    np.testing.assert_array_equal(state["dq"][0], moving.speed)
    assert np.all(np.abs(state["law"][0]) > 0.0) and not np.any(state["sum"])
