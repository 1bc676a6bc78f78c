"""Healthy robots whose file describes another controller than the one that ran."""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import draw_experiments
from clie_blocks.analysis.blind.engine.robot import (
    DISCRETISATIONS,
    DrawnRobot,
    draw_robot,
    draw_truth,
)
from clie_blocks.analysis.blind.population.maker import (
    Population,
    RejectedError,
    Trial,
    leaves_set_point,
)
from clie_blocks.analysis.blind.scoring.robustness import CONTROLLER

Truth = dict[str, np.ndarray]
Misstatement = Callable[[np.random.Generator, DrawnRobot, Truth], tuple[DrawnRobot, Truth, str]]


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    name = list(MISSTATEMENTS)[index % len(MISSTATEMENTS)]
    robot = draw_robot(rng)
    stated, truth, wrong = MISSTATEMENTS[name](rng, robot, draw_truth(rng, robot))
    experiments = draw_experiments(rng, robot)
    noises = [robot.sigma * rng.standard_normal(one.q_d.shape) for one in experiments]
    runs = run(robot, [truth] * len(experiments), experiments, noises, seed=index)
    if leaves_set_point(experiments, runs):
        raise RejectedError("unstable")
    return Trial(stated, experiments, runs, {
        "kind": "misdescribed", "labels": [name], "wrong": wrong,
        "present": [CONTROLLER, *(["gain_error"] if name in ("Kd", "Kp") else [])],
        "robot": f"{robot.kind} of {robot.n}"})


def _misstate_discretisation(rng: np.random.Generator, robot: DrawnRobot,
                             truth: Truth) -> tuple[DrawnRobot, Truth, str]:
    others = sorted(set(DISCRETISATIONS) - {robot.discretisation})
    stated = str(rng.choice(others))
    return dataclasses.replace(robot, discretisation=stated), truth, f"stated {stated}"


def _misstate_corner(which: int) -> Misstatement:
    def draw(rng: np.random.Generator, robot: DrawnRobot,
             truth: Truth) -> tuple[DrawnRobot, Truth, str]:
        factor, corners = _factor(rng, 1.2, 1.8), list(robot.corners)
        corners[which] = round(corners[which] * factor, 1)
        stated = dataclasses.replace(robot, corners=(corners[0], corners[1]))
        return stated, truth, f"stated x {factor:.3g}"
    return draw


def _misstate_gain(key: str, least: float, most: float) -> Misstatement:
    """Return a draw of a gain that is stated wrong at one joint."""
    def draw(rng: np.random.Generator, robot: DrawnRobot,
             truth: Truth) -> tuple[DrawnRobot, Truth, str]:
        factor, gains = _factor(rng, least, most), getattr(robot, key).copy()
        gains[rng.integers(robot.n)] *= factor
        stated = dataclasses.replace(robot, kp=gains) if key == "kp" else dataclasses.replace(
            robot, kd=gains)
        return stated, truth, f"stated x {factor:.3g}"
    return draw


def _delay_command(rng: np.random.Generator, robot: DrawnRobot,
                   truth: Truth) -> tuple[DrawnRobot, Truth, str]:
    """Command that is computed in one period and sent in the next, which the file omits."""
    return robot, {**truth, "behind": np.ones(robot.n)}, "sent one period later"


def _factor(rng: np.random.Generator, least: float, most: float) -> float:
    """Factor above or below one."""
    return float(np.exp(rng.choice([-1, 1]) * rng.uniform(np.log(least), np.log(most))))


MISSTATEMENTS: dict[str, Misstatement] = {
    "discretisation of the velocity filter": _misstate_discretisation,
    "low-pass corner": _misstate_corner(1), "high-pass corner": _misstate_corner(0),
    "Kd": _misstate_gain("kd", 1.05, 1.5), "Kp": _misstate_gain("kp", 1.03, 1.3),
    "one period of delay": _delay_command}

CONTROLLERS = Population(_draw, (1,))
