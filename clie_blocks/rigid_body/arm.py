"""Arms: a tree of links with gears and motors, as one block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import DiagramError, vector
from clie_blocks.rigid_body.dynamics import (
    bias_torque,
    forward_dynamics,
    mass_rows,
    solve_symmetric,
)
from clie_blocks.rigid_body.motor_coupling import (
    Matrix,
    coupling_of,
    inverse_of,
    mapped,
    motor_mass_rows,
    motor_torques,
)
from clie_blocks.rigid_body.scalars import total
from clie_blocks.rigid_body.tree import Body, Tree, tree

if TYPE_CHECKING:
    import control as ct


def planar_tree(mass: ArrayLike, length: ArrayLike, *, com: ArrayLike | None = None,
                j_link: ArrayLike = 0.0, g: float = 9.81) -> Tree:
    """Chain of links in one vertical plane, as in section 5: q1 = 0 is horizontal.

    Parameters
    ----------
    mass, length : array_like, shape (n,)
        Of the links [kg, m].
    com : array_like, shape (n,), optional
        Distance of each centre of mass from its joint [m]; by default the length of the link.
    j_link : array_like, shape (n,)
        Link inertias about their centres of mass [kg m^2].
    g : float
        Acceleration of gravity [m/s^2], against the second axis of the plane.

    """
    mass = vector(mass, "mass", unit="kg", least=0)
    n = mass.size
    length = vector(length, "length", n=n, unit="m")
    com = length if com is None else vector(com, "com", n=n, unit="m")
    j_link = vector(j_link, "j_link", n=n, unit="kg m^2", least=0)
    ends = np.concatenate(([0.0], length[:-1]))
    bodies = [Body(f"joint{k + 1}", f"joint{k}" if k else None, np.eye(3),
                   np.array([ends[k], 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), mass[k],
                   np.array([com[k], 0.0, 0.0]), np.diag([0.0, j_link[k], j_link[k]]))
              for k in range(n)]
    return tree(bodies, gravity=(0.0, -g, 0.0))


def articulated_arm(links: Tree, gear_ratio: ArrayLike, j_motor: ArrayLike, b_motor: ArrayLike, *,
                    h: ArrayLike = 0.0, motor_coupling: ArrayLike | None = None,
                    name: str = "plant") -> ct.NonlinearIOSystem:
    """Arm of any tree of links, with motors and gears, eqs. (1)-(7), no decoupling assumed.

    Inputs: u [N m], motor side.  Outputs: q [rad], dq [rad/s].  State: q, dq.

    Parameters
    ----------
    links : Tree
        Links and gravity, as constants of the block.
    gear_ratio : array_like, shape (n,)
        Motor turns per joint turn; negative where they turn against each other, not zero.
    j_motor, b_motor : array_like, shape (n,)
        Rotor inertias [kg m^2] (positive) and rotor friction [N m s/rad].
    h : array_like, shape (n,)
        Viscous friction of the joint bearings [N m s/rad].
    motor_coupling : array_like, shape (n, n), optional
        Matrix C of motors that turn several joints, ``q = C q_m`` with the positions q_m of the
        motors over their gear ratios; by default each turns its own joint.
    name : str
        Name of the block; the keys are ``'{name}.gear_ratio'`` and so on.

    Returns
    -------
    control.NonlinearIOSystem
        The block.

    Raises
    ------
    DiagramError
        If a length differs from the number of joints or a quantity is out of bounds.

    Notes
    -----
    Rigid links and gears.  Of a rotor only its turns about its own axis count, as the paper has
    it; its gyroscopic torque on the link that carries it is left out, see
    `clie_blocks.rigid_body.dynamics.Rotors`.

    """
    from clie_blocks.joints import second_order

    n = links.n
    params = {"gear_ratio": vector(gear_ratio, f"{name}: gear_ratio", n=n),
              "j_motor": vector(j_motor, f"{name}: j_motor", n=n, unit="kg m^2", above=0),
              "b_motor": vector(b_motor, f"{name}: b_motor", n=n, unit="N m s/rad", least=0),
              "h": vector(h, f"{name}: h", n=n, unit="N m s/rad", least=0)}
    if not params["gear_ratio"].all():
        raise DiagramError(f"{name}: gear_ratio holds a zero; a joint that no motor turns has "
                           "none: lock it in the model")
    coupling = (None if motor_coupling is None else
                coupling_of(motor_coupling, n, f"{name}: motor_coupling"))
    inverse = None if coupling is None else inverse_of(coupling)

    def acceleration(q: np.ndarray, dq: np.ndarray, u: np.ndarray,
                     params: dict[str, np.ndarray]) -> np.ndarray:
        ratio, inertia, friction, bearing = (params[f"{name}.{key}"] for key in (
            "gear_ratio", "j_motor", "b_motor", "h"))
        if coupling is not None and inverse is not None:
            drag = motor_torques(coupling, bearing * dq)
            torque = ratio * u - ratio * ratio * friction * mapped(inverse, dq) - drag
            return _coupled_acceleration(links, coupling, q, dq, torque, ratio * ratio * inertia)
        torque = ratio * u - (ratio * ratio * friction + bearing) * dq
        return forward_dynamics(links, q, dq, torque, ratio * ratio * inertia)

    return second_order(acceleration, {f"{name}.{key}": value for key, value in params.items()},
                        n=n, name=name)


def _coupled_acceleration(links: Tree, coupling: Matrix, q: np.ndarray, dq: np.ndarray,
                          torque: np.ndarray, rotors: np.ndarray) -> np.ndarray:
    """Acceleration of joints under torques of motors that turn several of them.

    In the positions of the motors: ``(C' M C + rotors) ddq_m + C' bias = torque``.
    """
    n = links.n
    rows = motor_mass_rows(coupling, mass_rows(links, [q[..., k] for k in range(n)]))
    matrix = [[total(entry, rotors[..., k]) if j == k else entry for k, entry in enumerate(row)]
              for j, row in enumerate(rows)]
    left = torque - motor_torques(coupling, bias_torque(links, q, dq))
    of_motors = solve_symmetric(matrix, [left[..., k] for k in range(n)])
    return mapped(coupling, np.stack(of_motors, axis=-1))
