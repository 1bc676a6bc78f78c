"""Terms of the joint's equation ``J ddq + F dq + c + ... + known = u``, one column each.

Inertia J, viscous friction F and offset c are the paper's model, eq. (8) on the motor side and in
the unit of the command; further terms can be added by name.
"""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.identification.motion import Run, stiction
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import ClieError, nearest
from clie_blocks.manipulator import coriolis, gravity, mass_matrix
from clie_blocks.rigid_body import dynamics as tree_dynamics
from clie_blocks.rigid_body.motor_coupling import mapped, motor_torques
from clie_blocks.rigid_body.tree import Tree

BASE = ("inertia", "viscous", "offset")
EXTRA = {"coulomb": "dry friction, constant against the motion",
         "weight_cos": "weight of a link, cos q", "weight_sin": "weight of a link, sin q"}


def term_names(extra: Sequence[str]) -> tuple[str, ...]:
    """Names of all terms, the paper's three first.

    Raises
    ------
    ClieError
        If a name is not known.

    """
    for name in extra:
        if name not in EXTRA:
            raise ClieError(f"no term {name!r} to add; {nearest(name, EXTRA)}")
    return (*BASE, *extra)


def terms(names: Sequence[str], q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
          top_speed: float) -> np.ndarray:
    """Columns of the regressor of one joint along its motion, shape (N, p).

    The top speed of the whole experiment sets where dry friction turns its sign.
    """
    columns = {"inertia": lambda: ddq, "viscous": lambda: dq, "offset": lambda: np.ones_like(q),
            "coulomb": lambda: stiction(dq, top_speed),
            "weight_cos": lambda: np.cos(q), "weight_sin": lambda: np.sin(q)}
    return np.column_stack([np.empty((len(q), 0)), *(columns[name]() for name in names)])


def known_load(run: Run, robot: Robot) -> np.ndarray:
    """Torque of the links that the nominal model contains, in the unit of u, shape (N, n).

    Weight, and the inertia coupling beyond the constant inertia at the first position, by eqs.
    (1) to (7) for one or two links, or for those of a model; zero for what `robot.toml` does not
    state.
    """
    zero = np.zeros(run.q.shape)
    links, nominal, ratio = robot.links, robot.nominal, robot.motor.gear_ratio
    if robot.tree is not None and ratio is not None:
        return _load_of_tree(run, robot.tree, robot) / _torque_scale(robot)
    mass, com, length = links.mass, links.com, links.length
    if mass is None or com is None or ratio is None or robot.n > 2:
        return zero
    load = zero
    if nominal.gravity and robot.n == 1:
        load = mass * com * nominal.g * np.cos(run.q)
    elif nominal.gravity and length is not None:
        load = gravity(run.q.T, mass, length, com, nominal.g).T
    if nominal.coupling and robot.n == 2 and length is not None:
        own = np.zeros(2) if links.inertia is None else links.inertia
        load = load + _coupling(run, mass, length, com, own)
    return load / _torque_scale(robot)


def _torque_scale(robot: Robot) -> np.ndarray:
    """Torque on the joint side per command, shape (n,)."""
    motor, one = robot.motor, np.ones(robot.n)
    ratio = one if motor.gear_ratio is None else motor.gear_ratio
    return ratio if motor.torque_gain is None else ratio * motor.torque_gain


def _load_of_tree(run: Run, links: Tree, robot: Robot) -> np.ndarray:
    """Torque of the links of a model beyond their inertia at the first position, (N, n)."""
    if robot.nominal.gravity is False:
        links = links.with_gravity((0.0, 0.0, 0.0))
    coupling = robot.motor_coupling
    q, dq, ddq = (x if coupling is None else mapped(coupling, x)
                  for x in (run.q, run.dq, run.ddq))
    if robot.nominal.coupling is False:
        load = tree_dynamics.gravity_torque(links, q)
        return load if coupling is None else motor_torques(coupling, load)
    load = tree_dynamics.inverse_dynamics(links, q, dq, ddq)
    mass = tree_dynamics.mass_matrix(links, q[0])
    if coupling is not None:
        load = motor_torques(coupling, load)
        mass = np.transpose(coupling) @ mass @ np.array(coupling)
    return load - mass.diagonal() * run.ddq


def _coupling(run: Run, mass: np.ndarray, length: np.ndarray, com: np.ndarray,
              inertia: np.ndarray) -> np.ndarray:
    """Torque of the mass matrix beyond its first diagonal, and of the Coriolis matrix, (N, 2)."""
    own = np.broadcast_to(inertia[:, None], run.q.T.shape)  # M gets the time axis
    matrix = mass_matrix(run.q.T, mass, length, com, own)
    constant = np.diag(np.diag(matrix[..., 0]))
    spin = coriolis(run.q.T, run.dq.T, mass, length, com)
    return (np.einsum("ijt,tj->ti", matrix - constant[..., None], run.ddq)
            + np.einsum("ijt,tj->ti", spin, run.dq))
