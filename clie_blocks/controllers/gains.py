"""Gains of a control law, one of each per joint."""

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.signals import DiagramError, vector


def positive_gains(kp: ArrayLike, kd: ArrayLike, name: str) -> dict[str, np.ndarray]:
    """Gains Kp [N m/rad] and Kd [N m s/rad] of (11) by key, refused where one is not positive."""
    gains = {"kp": vector(kp, f"{name}: kp", unit="N m/rad", above=0),
             "kd": vector(kd, f"{name}: kd", unit="N m s/rad", above=0)}
    if gains["kp"].size != gains["kd"].size:
        raise DiagramError(f"{name}: kp has {gains['kp'].size} gains but kd has "
                           f"{gains['kd'].size}; give one of each per joint")
    return gains
