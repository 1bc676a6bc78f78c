"""The planar chain of links that a robot file states."""

import dataclasses

import numpy as np

from clie_blocks.analysis.records import Robot
from clie_blocks.robot_loop.planar_chain import PlanarChain, mass_matrix


def planar_chain(robot: Robot, pose: np.ndarray) -> PlanarChain:
    """Return the chain that a robot file states, with its inertia at a pose."""
    links, n = robot.links, robot.n
    known = (links.mass is not None and links.length is not None
             and bool(np.all(links.mass > 0) and np.all(links.length > 0)))
    zero = np.zeros(n)
    chain = PlanarChain(
        length=_stated_or_zero(links.length, n),
        mass=_stated_or_zero(links.mass, n) if known else zero,
        com=_stated_or_zero(links.com, n),
        inertia=_stated_or_zero(links.inertia, n) if known else zero,
        bearing_damping=_stated_or_zero(links.joint_viscous_friction, n), g=robot.nominal.g,
        has_gravity=known and bool(robot.nominal.gravity),
        has_coupling=known and robot.nominal.coupling and n > 1, diagonal=zero, known=known)
    rows = mass_matrix(chain, np.asarray(pose, float))
    return dataclasses.replace(chain, diagonal=np.array([rows[k][k] for k in range(n)]))


def _stated_or_zero(value: np.ndarray | None, n: int) -> np.ndarray:
    return np.zeros(n) if value is None else np.array(value, float)
