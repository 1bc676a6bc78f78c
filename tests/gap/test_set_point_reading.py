"""Set-points that are held from row to row, that go on between rows, and that are late besides."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.explain import EXPLAIN_STEPS
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.position_path import servo_response
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.set_point_reading import read_set_points
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller

ROW, PART = 0.02, 10  # s, and steps of the servo in a row
SERVO = {"frequency": 25.0, "damping_ratio": 0.9, "offset": 0.0}
NOISE = 1e-4  # rad


def set_points(time, seed):
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, 4)
    return sum(0.12 * np.sin(2 * np.pi * f * time + p) for f, p in zip(
        (0.31, 0.7, 1.3, 1.9), phase))


def log(seed, held, delay=0.0, law="unknown"):
    """Log of a servo at the rate of its rows."""
    fine = ROW / PART * np.arange(750 * PART)
    goal = set_points(fine, seed)
    sent = goal[::PART]
    q = (servo_response(sent, sent[0], ROW, delay=delay, **SERVO) if held else
         servo_response(goal, goal[0], ROW / PART, delay=delay, **SERVO)[::PART])
    q = q + NOISE * np.random.default_rng([seed, 1]).standard_normal(q.size)
    robot = Robot(n=1, controller=Controller(law=law) if law == "unknown" else Controller(
        law=law, kp=[1.0], kd=[0.1], velocity_filter="difference"))
    return robot, Record(time=fine[::PART], q=q[:, None], qd=sent[:, None], robot=robot)


def problem_of(**how):
    robot, first = log(1, **how)
    return Problem.from_logs(robot, [first, log(2, **how)[1]], trust_logs=True)


@pytest.mark.parametrize("held", [True, False], ids=["held", "on a line"])
def test_the_motion_tells_what_set_points_do_between_rows(held):
    problem = problem_of(held=held)
    read = read_set_points(problem, METHOD, EXPLAIN_STEPS)
    steps = np.diff(read.logs[0].q_d[:, 0])
    between = np.arange(steps.size) % read.logs[0].stride != read.logs[0].stride - 1
    assert read.logs[0].stride > 1 and bool(np.any(steps[between])) != held
    assert ("held from row to row" in " ".join(read.records[0].decisions)) == held
    assert read.statement is problem.statement


def test_a_delay_of_several_rows_is_none_of_them():
    problem = problem_of(held=False, delay=0.06)
    assert read_set_points(problem, METHOD, EXPLAIN_STEPS) is problem


def test_a_stated_law_keeps_its_set_points():
    problem = problem_of(held=True, law="pd")
    assert read_set_points(problem, METHOD, EXPLAIN_STEPS) is problem
