"""The sign of a velocity, smoothed over a width: what most friction laws share."""

import numpy as np

from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint

WIDTH = Parameter("width", "rad/s", 1e-6, 1.0, 1e-3, None,
                  "speed over which the sign is smoothed; scale of the creep of a stuck joint",
                  of="run")
CREEP = ("Smoothed, it creeps: under a load below the level the joint moves at "
         "width atanh(load/level) instead of sticking; its form sticking(effect) holds.")


def direction(dq: np.ndarray, width: PerJoint) -> np.ndarray:
    """Direction of motion, ``tanh(dq / width)``: odd, between -1 and 1."""
    return np.tanh(dq / width)
