"""The links of a corrected arm, as an answer holds them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from clie_blocks.rigid_body.motor_coupling import Matrix, coupling_of, inverse_of


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """One link in the frame of its joint, whose axis is z.

    Parameters
    ----------
    parent : int
        Link that carries it, from 0; -1 is the base.
    rotation, offset : ndarray, shape (3, 3), (3,)
        Frame of the joint in that of its parent [m].
    mass : float
        In kg.
    com : ndarray, shape (3,)
        Centre of mass [m].
    inertia : ndarray, shape (6,)
        About the centre of mass, xx, yy, zz, xy, xz, yz [kg m^2].
    reads_zero_at : float
        Logged position at which the link is in its zero [rad or m].

    """

    parent: int
    rotation: np.ndarray
    offset: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    reads_zero_at: float


@dataclasses.dataclass(frozen=True, eq=False)
class Arm:
    """The corrected links of a robot whose file states them.

    Parameters
    ----------
    bodies : tuple of Body
        In the order of the joints.
    gravity : ndarray, shape (3,)
        In the frame of the base [m/s^2].
    payload : float
        Mass at the tip that was identified [kg].
    tip : ndarray, shape (3,)
        End of the last link, in the frame of its joint [m].
    motor_coupling : tuple of tuple, optional
        Matrix C of motors that turn several joints, see `clie_blocks.rigid_body.motor_coupling`.

    """

    bodies: tuple[Body, ...]
    gravity: np.ndarray
    payload: float
    tip: np.ndarray
    motor_coupling: Matrix | None = None

    @property
    def shares(self) -> Matrix | None:
        """Rows of C^-1: how each joint moves each motor, over its gear ratio."""
        return None if self.motor_coupling is None else inverse_of(self.motor_coupling)


def read_arm(plain: Mapping[str, Any] | None) -> Arm | None:
    """Return the arm of an answer; None where no links were stated."""
    if plain is None:
        return None
    coupling = plain["motor_coupling"]
    bodies = tuple(Body(
        one["parent"] - 1, np.asarray(one["rotation"], float), np.asarray(one["offset"], float),
        float(one["mass"]), np.asarray(one["com"], float), np.asarray(one["inertia"], float),
        float(one["reads_zero_at"])) for one in plain["bodies"])
    return Arm(bodies, np.asarray(plain["gravity"], float), float(plain["payload"]),
               np.asarray(plain["tip"], float),
               None if coupling is None else coupling_of(coupling, len(bodies)))
