"""Rotations (3, 3) from axes, angles and quaternions."""

import math

import numpy as np

from clie_blocks.errors import ClieError

_ALONG = 1e-12  # of a unit axis, across z, below which it is z itself


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about a unit axis by an angle [rad], by Rodrigues' formula."""
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * across @ across


def rotation_from_z(axis: np.ndarray, what: str) -> np.ndarray:
    """Shortest rotation that turns z into the direction of an axis; see `unit` for `what`."""
    axis = unit(axis, what)
    across = np.array([-axis[1], axis[0], 0.0])
    sine = np.linalg.norm(across)
    if sine < _ALONG:
        return np.diag([1.0, math.copysign(1.0, axis[2]), math.copysign(1.0, axis[2])])
    return turn_about(across / sine, math.atan2(sine, axis[2]))


def of_quaternion(quaternion: np.ndarray, what: str) -> np.ndarray:
    """Rotation of a quaternion w, x, y, z of any length but 0; see `unit` for `what`."""
    w, x, y, z = unit(quaternion, what)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def unit(vector: np.ndarray, what: str) -> np.ndarray:
    """Return a vector of length one.

    Raises
    ------
    ClieError
        If it has no direction; `what` says in the message which vector it is.

    """
    length = np.linalg.norm(vector)
    if not np.isfinite(length) or length == 0.0:
        raise ClieError(f"{what} is {np.asarray(vector).tolist()}, which has no direction; one of "
                        "its numbers must not be zero")
    return vector / length
