"""Volume and moments of inertia of the solids that simulators have."""

import math

import numpy as np

SOLIDS = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Numbers of their size: radius; radius and half the length along z; half the axes, or edges."""


def solid(kind: str, size: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume [m^3] and principal moments per mass, (3,) [m^2], of a solid.

    Parameters
    ----------
    kind : str
        One of `SOLIDS`.
    size : ndarray
        Its size [m].

    """
    if kind == "box":
        x, y, z = size[:3] ** 2
        return 8.0 * float(np.prod(size[:3])), np.array([y + z, x + z, x + y]) / 3.0
    if kind in ("ellipsoid", "sphere"):
        half = size[:3] if kind == "ellipsoid" else np.repeat(size[:1], 3)
        x, y, z = half**2
        return 4.0 / 3.0 * math.pi * float(np.prod(half)), np.array([y + z, x + z, x + y]) / 5.0
    radius, half_length = size[:2]
    rod, square = 2.0 * math.pi * radius**2 * half_length, radius**2
    across = square / 4.0 + half_length**2 / 3.0
    if kind == "cylinder":
        return rod, np.array([across, across, square / 2.0])
    caps = 4.0 / 3.0 * math.pi * radius**3  # the two halves of a sphere
    share = caps / (rod + caps)
    of_caps = 0.4 * square + half_length**2 + 0.75 * half_length * radius
    side = (1.0 - share) * across + share * of_caps
    return rod + caps, np.array([side, side, ((1.0 - share) / 2.0 + 0.4 * share) * square])
