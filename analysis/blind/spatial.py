"""Sound arms with a vertical first axis that carries two links: no planar chain describes them.

Their file states what the drives hold, and no links: how the joints pull at each other, and how
the inertia about the vertical changes with the pose, is told to nobody.  Springs balance the
weight.  What the diagnosis finds is none of its effects, so that "unknown" is the right answer
wherever anything shows.
"""

from clie_blocks.analysis.blind.robot import draw_robot, draw_truth
from clie_blocks.analysis.blind.sound import make_sound

STREAM = 2
UNTOLD = "links"


def make_trial(seed, index):
    """Make one trial.

    Parameters
    ----------
    seed : int
        Of the study.
    index : int
        Number of the trial.

    Returns
    -------
    Trial
        The same for the same numbers.

    """
    return make_sound(seed, index, STREAM, UNTOLD, _draw)


def _draw(rng):
    robot = draw_robot(rng, "spatial")
    share = robot.link / (robot.rotor * robot.ratio**2)
    return robot, robot, draw_truth(rng, robot), f"links hold {share.max():.0%} of the inertia"
