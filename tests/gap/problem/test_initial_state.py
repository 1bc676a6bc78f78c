"""Logs that begin in motion: their velocity is read from the law and the first positions."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.problem.initial_state import with_initial_state
from clie_blocks.analysis.gap.problem.problem import Problem


@pytest.fixture(scope="module")
def problem():
    case = draw_cases(1, 9, ["coulomb"], ["none"], duration=8.0)[0]
    return Problem.from_logs(case.robot, case.records)


def cut(log, samples):
    """The log without its first samples; what was stated of its start is no longer true."""
    rows = {name: getattr(log, name)[samples:] for name in ("q", "u", "q_d", "pe", "dither")}
    return dataclasses.replace(log, **rows)


def test_logs_that_begin_at_rest_are_left_as_they_are(problem):
    assert all(with_initial_state(log, problem.law) is log for log in problem.logs)


def test_a_log_that_was_cut_begins_where_and_as_fast_as_the_robot_was(problem):
    log = problem.fit[0]
    speed = np.gradient(log.q, problem.period, axis=0)
    smooth = lfilter(np.ones(40) / 40, 1.0, speed, axis=0)[39:]
    samples = int(np.abs(smooth).max(axis=1).argmax()) + 20
    moving = with_initial_state(cut(log, samples), problem.law)
    assert not moving.at_rest and np.array_equal(moving.start, log.q[samples])
    assert moving.speed == pytest.approx(smooth[samples - 20], abs=0.05 * np.abs(smooth).max())
