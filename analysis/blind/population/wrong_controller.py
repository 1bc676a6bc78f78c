"""Sound robots whose file describes another controller than the one that ran."""

import dataclasses

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import draw_motions
from clie_blocks.analysis.blind.engine.robot import DISCRETISATIONS, draw_robot, draw_truth
from clie_blocks.analysis.blind.population.maker import Family, RejectedError, Trial, lost
from clie_blocks.analysis.blind.scoring.robustness import CONTROLLER


def _draw(rng, seed, index):
    name = list(WRONG)[index % len(WRONG)]
    robot = draw_robot(rng)
    stated, truth, wrong = WRONG[name](rng, robot, draw_truth(rng, robot))
    motions = draw_motions(rng, robot)
    noises = [robot.sigma * rng.standard_normal(motion.q_d.shape) for motion in motions]
    runs = run(robot, [truth] * len(motions), motions, noises, seed=index)
    if lost(motions, runs):
        raise RejectedError("unstable")
    return Trial(stated, motions, runs, {
        "kind": "misdescribed", "labels": [name], "wrong": wrong, "present": [CONTROLLER],
        "robot": f"{robot.kind} of {robot.n}"})


def _discretisation(rng, robot, truth):
    others = sorted(set(DISCRETISATIONS) - {robot.discretisation})
    stated = str(rng.choice(others))
    return dataclasses.replace(robot, discretisation=stated), truth, f"stated {stated}"


def _corner(which):
    def draw(rng, robot, truth):
        factor, corners = _factor(rng, 1.2, 1.8), list(robot.corners)
        corners[which] = round(corners[which] * factor, 1)
        return dataclasses.replace(robot, corners=tuple(corners)), truth, f"stated x {factor:.3g}"
    return draw


def _gain(key, least, most):
    """Gain that is stated wrong at one joint."""
    def draw(rng, robot, truth):
        factor, gains = _factor(rng, least, most), getattr(robot, key).copy()
        gains[rng.integers(robot.n)] *= factor
        return dataclasses.replace(robot, **{key: gains}), truth, f"stated x {factor:.3g}"
    return draw


def _late(rng, robot, truth):
    """Command that is worked out in one period and sent in the next, of which no word is said."""
    return robot, {**truth, "behind": np.ones(robot.n)}, "sent one period later"


def _factor(rng, least, most):
    """Factor above or below one."""
    return float(np.exp(rng.choice([-1, 1]) * rng.uniform(np.log(least), np.log(most))))


WRONG = {
    "discretisation of the velocity filter": _discretisation,
    "low-pass corner": _corner(1), "high-pass corner": _corner(0),
    "Kd": _gain("kd", 1.05, 1.5), "Kp": _gain("kp", 1.03, 1.3),
    "one period of delay": _late}

CONTROLLERS = Family(_draw, (1,))
