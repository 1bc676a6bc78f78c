"""Small robots that several tests share, simulated by code that the diagnosis does not use."""

import functools

import pytest

from clie_blocks.analysis.gap.own_robots import cases
from clie_blocks.analysis.gap.problem import problem


@functools.cache
def made(name, seed):
    """Robot with one effect, or ``none``; 6 s per log."""
    kind = "none" if name == "none" else "single"
    return cases(1, seed, [name] if kind == "single" else ["coulomb"], [kind], duration=6.0)[0]


@pytest.fixture(scope="session")
def case():
    """Function from an effect's name to a robot that has it."""
    return lambda name, seed=3: made(name, seed)


@pytest.fixture(scope="session")
def healthy(case):
    """Problem of a healthy robot."""
    robot = case("none")
    return problem(robot.robot, robot.records)
