"""Torques of masses on a link, as columns of a regression.

The torque of a point mass is a polynomial of second degree in its place, so that ten places give
it for all others: for 1 kg at c it is ``T phi(c)``, with the ten monomials phi of c.
"""

import dataclasses

import numpy as np

from clie_blocks.rigid_body import dynamics
from clie_blocks.robot_loop.links import Links

MONOMIALS = 10  # of second degree in three coordinates
_UNIT = np.eye(3)
_PLACES = np.array([np.zeros(3), *_UNIT, *(-_UNIT), _UNIT[0] + _UNIT[1], _UNIT[0] + _UNIT[2],
                    _UNIT[1] + _UNIT[2]])


def monomials(place: np.ndarray) -> np.ndarray:
    """Monomials of a place (..., 3) up to the second degree, shape (..., 10)."""
    x, y, z = np.moveaxis(np.asarray(place, float), -1, 0)
    return np.stack([1.0 + 0.0 * x, x, y, z, x * x, y * y, z * z, x * y, x * z, y * z], axis=-1)


def torque_columns(links: Links, k: int, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
                   ) -> np.ndarray:
    """Torques of 1 kg on link k over the monomials of its place, shape (N, n, 10) [N m/kg].

    Parameters
    ----------
    links : Links
        Their geometry; with the weight of the mass where gravity acts on them.
    k : int
        The link that carries the mass.
    q, dq, ddq : ndarray, shape (N, n)
        Motion [rad, rad/s, rad/s^2].

    """
    torques = [_torque(links, k, place, q, dq, ddq) for place in _PLACES]
    return np.stack(torques, axis=-1) @ np.linalg.inv(monomials(_PLACES)).T


def _torque(links: Links, k: int, place: np.ndarray, q: np.ndarray, dq: np.ndarray,
            ddq: np.ndarray) -> np.ndarray:
    com = np.zeros((links.n, 3))
    com[k] = place
    tree = dataclasses.replace(links, mass=np.eye(links.n)[k], com=com,
                               inertia=0.0 * links.inertia).tree
    felt = tree if links.has_gravity else tree.with_gravity((0.0, 0.0, 0.0))
    return dynamics.inverse_dynamics(felt, q, dq, ddq)
