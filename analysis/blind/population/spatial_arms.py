"""Arms with a vertical first axis that carries two links: no planar chain describes them.

Their file states what the drives hold, and no links: how the joints pull at each other, and how
the inertia about the vertical changes with the pose, is told to nobody.  Springs balance the
weight.  Every other arm is sound; then "unknown" is right wherever anything shows.  The others
have an effect on top, which may be named, but in whose place no other one may be accused.
"""

import numpy as np

from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS
from clie_blocks.analysis.blind.population.maker import Family
from clie_blocks.analysis.blind.population.standard import afflicted

UNTOLD = "links alone"
POSSIBLE = tuple(name for name in EFFECTS if name not in NEEDS)  # those that need no stated links
SIZES = ("medium", "strong")


def plan(seed, index):
    """Effects and size of a trial: every other arm is sound, the others have effects in turn."""
    turn, sound = index // 2, index % 2 == 0
    if sound:
        return (), None
    order = np.random.default_rng([seed, 2, len(POSSIBLE)]).permutation(POSSIBLE)
    return (str(order[turn % len(order)]),), SIZES[turn % len(SIZES)]


def _draw(rng, seed, index):
    names, severity = plan(seed, index)
    trial = afflicted(rng, index, "spatial", names, severity, "spatial")
    robot = trial.robot
    share = robot.link / (robot.rotor * robot.ratio**2)
    trial.label.update(labels=list(names) or [UNTOLD], present=list(names),
                       wrong=f"links hold {share.max():.0%} of the inertia")
    return trial


SPATIAL = Family(_draw, (2,))
