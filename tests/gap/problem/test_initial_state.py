"""Logs that begin in motion: the law tells, the speed is read, the filter is where it would be."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.problem.initial_state import with_initial_state
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation.loop_block import ramp_memory
from clie_blocks.analysis.records.velocity_filter import velocity_filter

PERIOD = 1e-3


@pytest.fixture(scope="module")
def asked():
    made = draw_cases(1, 9, ["coulomb"], ["none"], duration=8.0)[0]
    return Problem.from_logs(made.robot, made.records)


def cut(log, samples):
    """The log without its first samples; what was stated of its start is no longer true."""
    rows = {name: getattr(log, name)[samples:] for name in ("q", "u", "q_d", "pe", "dither")}
    return dataclasses.replace(log, **rows)


def test_logs_that_begin_at_rest_are_left_as_they_are(asked):
    assert all(with_initial_state(log, asked.law) is log for log in asked.logs)


def test_a_log_that_was_cut_begins_where_and_as_fast_as_the_robot_was(asked):
    log, h = asked.fit[0], asked.period
    speed = np.gradient(log.q, h, axis=0)
    smooth = lfilter(np.ones(40) / 40, 1.0, speed, axis=0)[39:]
    samples = int(np.abs(smooth).max(axis=1).argmax()) + 20
    found = with_initial_state(cut(log, samples), asked.law)
    assert not found.at_rest and np.array_equal(found.start, log.q[samples])
    assert found.speed == pytest.approx(smooth[samples - 20], abs=0.05 * np.abs(smooth).max())


@pytest.mark.parametrize("kind", ["tustin", "zoh", "backward", "matched"])
def test_the_memory_is_the_one_of_a_filter_that_has_run_all_along(kind):
    b, a = velocity_filter(kind, PERIOD, (200.0, 300.0))
    past = 0.7 * PERIOD * np.arange(-2000, 0)
    after = lfilter(b, a, past, zi=np.zeros(2))[1]
    assert ramp_memory(np.array([0.7]), b[:, None], a[:, None], PERIOD) == pytest.approx(
        after, rel=1e-6)


def test_a_law_without_velocity_remembers_nothing():
    b, a = velocity_filter("none", PERIOD)
    assert not ramp_memory(np.array([0.7]), b[:, None], a[:, None], PERIOD).any()
