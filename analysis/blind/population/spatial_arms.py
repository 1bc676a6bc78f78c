"""Arms with a vertical first axis that carries two links: no planar chain describes them.

Their file states the parameters of the drives and no links: neither the coupling of the joints nor
the inertia about the vertical, which changes with the pose, is described.  Springs balance the
weight.  Every other arm is healthy; then "unknown" is right wherever anything shows.  The others
have an effect as well, which may be named; any other effect is a false attribution.
"""

import numpy as np

from clie_blocks.analysis.blind.population.effects import EFFECTS, NEEDS
from clie_blocks.analysis.blind.population.maker import Population, Trial
from clie_blocks.analysis.blind.population.standard import draw_trial

LINKS_ONLY = "links alone"
POSSIBLE = tuple(name for name in EFFECTS if name not in NEEDS)  # those that need no stated links
SIZES = ("medium", "strong")


def plan(seed: int, index: int) -> tuple[tuple[str, ...], str | None]:
    """Effects and size of a trial: every other arm is healthy, the others have effects in turn."""
    turn, healthy = index // 2, index % 2 == 0
    if healthy:
        return (), None
    order = np.random.default_rng([seed, 2, len(POSSIBLE)]).permutation(POSSIBLE)
    return (str(order[turn % len(order)]),), SIZES[turn % len(SIZES)]


def _draw(rng: np.random.Generator, seed: int, index: int) -> Trial:
    names, severity = plan(seed, index)
    trial = draw_trial(rng, index, "spatial", names, severity, "spatial")
    robot = trial.robot
    share = robot.link / (robot.rotor * robot.ratio**2)
    trial.label.update(labels=list(names) or [LINKS_ONLY], present=list(names),
                       wrong=f"links hold {share.max():.0%} of the inertia")
    return trial


SPATIAL = Population(_draw, (2,))
