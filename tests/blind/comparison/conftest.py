"""Robots of the calibration's own engine, with one cause or none."""

import functools

import pytest

from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.problem.problem import Problem


@functools.cache
def draw(cause):
    kind = "none" if cause == "none" else "single"
    case = draw_cases(1, 9, ["coulomb"], [kind], duration=8.0)[0]
    return Problem.from_logs(case.robot, case.records), case.causes


@pytest.fixture(scope="session")
def own_robot():
    """Problem of a robot with ``coulomb`` or ``none``, and the joints of its causes."""
    return draw
