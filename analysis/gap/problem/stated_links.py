"""The links that a robot file states."""

import dataclasses

import numpy as np

from clie_blocks.analysis.records import Robot
from clie_blocks.robot_loop.links import Links, mass_rows, no_links, planar_links, tree_links


def stated_links(robot: Robot, pose: np.ndarray) -> Links:
    """Return the links that a robot file states, with their inertia at a pose."""
    links = _links(robot)
    if not links.known:
        return links
    rows = mass_rows(links, np.asarray(pose, float))
    return dataclasses.replace(links, diagonal=np.array([rows[k][k] for k in range(robot.n)]))


def _links(robot: Robot) -> Links:
    stated, nominal, n = robot.links, robot.nominal, robot.n
    bearing_damping = _stated_or_zero(stated.joint_viscous_friction, n)
    coupling = robot.motor_coupling
    if coupling is not None:  # the share of each motor in its own velocity
        bearing_damping = bearing_damping @ np.square(coupling)
    if robot.tree is not None:
        return tree_links(robot.tree, bearing_damping=bearing_damping,
                          has_gravity=nominal.gravity is not False,
                          has_coupling=nominal.coupling is not False and n > 1,
                          motor_coupling=coupling)
    if (stated.mass is None or stated.length is None
            or not np.all((stated.mass > 0) & (stated.length > 0))):
        return dataclasses.replace(no_links(n), bearing_damping=bearing_damping)
    return planar_links(
        stated.length, stated.mass, _stated_or_zero(stated.com, n),
        _stated_or_zero(stated.inertia, n), g=nominal.g, bearing_damping=bearing_damping,
        has_gravity=bool(nominal.gravity), has_coupling=bool(nominal.coupling) and n > 1)


def _stated_or_zero(value: np.ndarray | None, n: int) -> np.ndarray:
    return np.zeros(n) if value is None else np.array(value, float)
