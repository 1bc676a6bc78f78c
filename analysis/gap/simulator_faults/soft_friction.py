"""Dry friction as engines with soft constraints hold it: a joint under load creeps.

Such a constraint is a stiff damper up to the level of the friction.  MuJoCo's lets through a
share 1 - d of the acceleration that the other torques would cause, and damps what moves at the
rate b = 2 / (0.95 time constant); so a joint at rest under a torque that would accelerate it by a
creeps at (1 - d) a / (d b).  The defaults are d = 0.9 and a time constant of 0.02 s.
"""

from collections.abc import Mapping

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.robot_loop.dynamics import Piece, State

IMPEDANCE, TIME_CONSTANT = 0.9, 0.02  # of a constraint of MuJoCo, by default
_LARGEST_IMPEDANCE = 0.95
CREEP_PER_ACCELERATION = ((1.0 - IMPEDANCE) / IMPEDANCE
                          * _LARGEST_IMPEDANCE * TIME_CONSTANT / 2.0)  # s


def _soft_friction(s: State, z: list[np.ndarray], p: Mapping[str, np.ndarray],
                   ) -> tuple[np.ndarray, list[np.ndarray]]:
    """Torque of a damper that yields at its level, implicit over a period [N m]."""
    free = s.u - s.carried - p["damping"] * s.dq
    to_stop = p["inertia"] * s.dq / s.h + free
    stiffness = s.h / CREEP_PER_ACCELERATION
    return np.clip(to_stop * stiffness / (1.0 + stiffness), -p["level"], p["level"]), z


SOFT_FRICTION = Cause(
    "soft_friction", (Piece("load", _soft_friction),),
    (Number("level", "N m"), Number("inertia", "kg m^2", neutral=None),
     Number("damping", "N m s/rad", neutral=None)),
    lambda scene: [])
