"""A planar chain of links: what gravity, payload and coupling share.

Joint angles are relative to the link before; q[0] = 0 is horizontal and gravity pulls along -y.
"""

import numpy as np

from clie_blocks.effects.parameter import Parameter

GEAR_RATIO = Parameter("gear_ratio", "1", 0.1, 1e4, 1.0, None,
                       "motor turns per joint turn; 1 if the other values are of the motor side",
                       of="robot")


def absolute(joint: np.ndarray) -> np.ndarray:
    """Absolute angle (or rate) of each link: the sum over the joints up to it."""
    return joint @ np.triu(np.ones((joint.shape[-1],) * 2))


def onto_joints(link: np.ndarray) -> np.ndarray:
    """Torque of each joint from torques on the links: the sum over the links beyond it."""
    return link @ np.tril(np.ones((link.shape[-1],) * 2))
