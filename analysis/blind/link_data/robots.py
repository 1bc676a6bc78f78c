"""Arms in space whose robot file states wrong links, or the drives alone.

Of four arms two have links that are all heavier or lighter than their tolerance allows, and two
come without any: the file states the rotors, and each joint turns several times as much.  Every
other arm of both kinds is sound; the others have an effect as well, which may be named.  That the
file is wrong is right of all of them.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.blind.engine.robot import ARTICULATED, DRIVES_ALONE, DrawnRobot
from clie_blocks.analysis.blind.engine.spatial_links import MASS_TOLERANCE
from clie_blocks.analysis.blind.population.arms_in_space import NAMES
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.standard import Truth, draw_trial

WRONG, MISSING = "links beyond their tolerance", "no links stated"
SIZES = "medium", "strong"
_FARTHER = 1.5, 5.0  # times the tolerance of a mass, that every link is off


def plan(seed: int, index: int) -> tuple[str, tuple[str, ...], str | None]:
    """What is wrong with a file, and effects of the arm with their size."""
    turn, place = divmod(index, 4)
    hidden = (WRONG, MISSING)[place % 2]
    if place < 2:
        return hidden, (), None
    names = np.random.default_rng([seed, 6, len(NAMES.effects)]).permutation(list(NAMES.effects))
    turn = 2 * turn + place - 2
    return hidden, (str(names[turn % len(names)]),), SIZES[turn // 2 % len(SIZES)]


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    hidden, names, severity = plan(seed, index)
    trial = draw_trial(rng, index, "parametric", names, severity, ARTICULATED, vocabulary=NAMES,
                       wrong=_all_off if hidden == WRONG else _as_drawn)
    trial.label.update(kind="misdescribed", labels=[hidden], wrong=_how(hidden, trial),
                       present=[*names, "parametric"])
    if hidden == WRONG:
        return trial
    return dataclasses.replace(trial, robot=dataclasses.replace(
        trial.robot, kind=DRIVES_ALONE, links=None, gravity=False, coupling=False))


def _how(hidden: str, trial: Trial) -> str:
    if hidden == WRONG and trial.truth is not None:
        return "masses off by " + ", ".join(f"{share:+.0%}" for share in trial.truth["heavier"])
    return "a datasheet of the rotors alone"


def _all_off(rng: np.random.Generator, robot: DrawnRobot, truth: Truth) -> Truth:
    """True parameters with every link beyond its tolerance, each in its own direction."""
    off = MASS_TOLERANCE * rng.uniform(*_FARTHER, robot.n) * rng.choice([-1, 1], robot.n)
    return {**truth, "heavier": off}


def _as_drawn(rng: np.random.Generator, robot: DrawnRobot, truth: Truth) -> Truth:
    return truth


LINK_DATA = Population(_draw, (5,))
