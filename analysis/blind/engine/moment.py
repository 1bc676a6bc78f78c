"""What a torque may depend on at one moment."""

from typing import NamedTuple

import numpy as np


class Moment(NamedTuple):
    """Time [s], motion of the motor behind its gear, and its torque; arrays (lanes, n)."""

    t: float
    q: np.ndarray  # rad
    dq: np.ndarray  # rad/s
    u: np.ndarray  # N m, motor side
