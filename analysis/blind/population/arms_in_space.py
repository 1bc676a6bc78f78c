"""Arms in space whose links a model file states: four to seven axes, in the layouts of known arms.

Every link is heavier or lighter than stated, within the tolerance that is stated.  A robot has one
effect, two, none, a number beyond its tolerance, or an effect that no block of the catalogue
holds.
"""

import numpy as np

from clie_blocks.analysis.blind.engine.robot import ARTICULATED, DrawnRobot
from clie_blocks.analysis.blind.population.catalogue import PARAMETERS, beyond_tolerance
from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.population.foreign import FOREIGN
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.mechanical import MECHANICAL
from clie_blocks.analysis.blind.population.standard import (
    ONE_OF,
    Truth,
    draw_trial,
    size_in_turn,
)
from clie_blocks.analysis.blind.population.vocabulary import Vocabulary

KINDS = ("single",) * 13 + ("pair",) * 2 + ("none",) * 4 + ("parametric",) * 3 + ("unknown",) * 3
MASS = "mass"  # the name of a link whose mass is beyond its tolerance
_OF_ONE_PLANE = ("wall", "sloshing_payload", "bending_link", "soft_mount", "neighbour_spring",
                 "magnetic_detent")  # made for links in one plane
_OF_BARE_ROBOTS = ("gravity", "coupling")  # what a model file states
_WEIGHTY = (1, 2, 3)  # joints whose links weigh enough for their masses to show

NAMES = Vocabulary(
    effects={**{name: draw for name, draw in EFFECTS.items() if name not in _OF_BARE_ROBOTS},
             "base_tilt": MECHANICAL["base_tilt"]},
    outsiders={name: draw for name, draw in FOREIGN.items() if name not in _OF_ONE_PLANE},
    whole_robot=("payload", "base_tilt"), needs={}, motor_encoders=1 / 2)
_FREE = tuple(name for name in NAMES.effects if name not in NAMES.whole_robot)


def plan(seed: int, index: int) -> tuple[str, tuple[str, ...], str | None]:
    """Kind, names and severity of a trial, so that a study holds all of them in turn."""
    rng = np.random.default_rng([seed, 4, len(KINDS)])
    kinds = rng.permutation(KINDS)
    names = {"single": rng.permutation(list(NAMES.effects)),
             "unknown": rng.permutation(list(NAMES.outsiders)),
             "parametric": rng.permutation([*PARAMETERS, MASS])}
    lap, position = divmod(index, len(kinds))
    kind = str(kinds[position])
    turn = lap * KINDS.count(kind) + int(np.sum(kinds[:position] == kind))
    if kind == "pair":
        return kind, _two(np.random.default_rng([seed, 5, turn])), "medium"
    if kind == "none":
        return kind, (), None
    name = str(names[kind][turn % len(names[kind])])
    if kind == "parametric":
        return kind, (name,), None
    return kind, (name,), size_in_turn(turn + turn // len(names[kind]), int(kind == "unknown"))


def _two(rng: np.random.Generator) -> tuple[str, ...]:
    """Two effects that any joint may have at once."""
    while True:
        names = tuple(map(str, rng.choice(_FREE, 2, replace=False)))
        if all(len(set(names) & set(group)) < 2 for group in ONE_OF):
            return names


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    kind, names, severity = plan(seed, index)
    if kind != "parametric":
        return draw_trial(rng, index, kind, names, severity, ARTICULATED, vocabulary=NAMES)
    (name,) = names
    trial = draw_trial(rng, index, kind, (), None, ARTICULATED, vocabulary=NAMES,
                       wrong=_heavier_link if name == MASS else beyond_tolerance(name))
    trial.label["labels"] = [name]
    return trial


def _heavier_link(rng: np.random.Generator, robot: DrawnRobot, truth: Truth) -> Truth:
    """True parameters with one link that is heavier or lighter than its tolerance allows."""
    heavier = truth["heavier"].copy()
    heavier[rng.choice(_WEIGHTY)] = rng.choice([-1, 1]) * rng.uniform(0.2, 0.4)
    return {**truth, "heavier": heavier}


ARMS_IN_SPACE = Population(_draw, (4,))
