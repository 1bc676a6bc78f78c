"""Rigid-body terms of a tree of links: M, C and G of eq. (1), energy, motion and torque.

Recursive Newton-Euler on scalars, so that one text runs on numbers, on time series, on symbols of
a diagram and as machine code.  Positions are (..., n) [rad, or m for a sliding joint], torques
(..., n) on the joint side [N m, or N].
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.rigid_body.scalars import (
    ZERO,
    Rows,
    Scalar,
    Three,
    added,
    cross,
    dot,
    numbers,
    product,
    scaled,
    times,
    total,
    transposed_product,
)
from clie_blocks.rigid_body.tree import Tree

Body = tuple[Scalar, Three, Rows]  # mass, mass times centre, inertia about the origin

_Z: Three = (0.0, 0.0, 1.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Rotors:
    """Motors that turn about the axes of their joints, each on the link before.

    The inertia of a link holds the rotor that it carries as if that were locked, as models from
    CAD do.

    Parameters
    ----------
    inertia : array_like, shape (n,)
        Of the rotors about their axes [kg m^2].
    gear_ratio : array_like, shape (n,)
        Motor turns per joint turn; negative where they turn against each other.

    """

    inertia: np.ndarray
    gear_ratio: np.ndarray


def inverse_dynamics(tree: Tree, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
                     rotors: Rotors | None = None) -> np.ndarray:
    """Torques that a motion takes, eq. (1): ``M(q) ddq + C(q, dq) dq + G(q)``.

    Parameters
    ----------
    tree : Tree
        The links.
    q, dq, ddq : ndarray, shape (..., n)
        Positions, velocities, accelerations.
    rotors : Rotors, optional
        With them the torques of the rotors on their joints and, gyroscopically, on the links that
        carry them are there, too; without them the links alone.

    """
    torque = _torques(tree, _parts(q), _parts(dq), _parts(ddq), numbers(tree.gravity), rotors)
    return _stacked(torque, q)


def gravity_torque(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Weight of the links, G(q) of eq. (1)."""
    rest = [0.0] * tree.n
    return _stacked(_torques(tree, _parts(q), rest, rest, numbers(tree.gravity)), q)


def velocity_torque(tree: Tree, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Coriolis and centrifugal torque, C(q, dq) dq of eq. (1)."""
    return _stacked(_velocity_torques(tree, _parts(q), _parts(dq)), q)


def bias_torque(tree: Tree, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Velocity torque and weight together, C(q, dq) dq + G(q), at the cost of the former."""
    return _stacked(_bias_torques(tree, _parts(q), _parts(dq)), q)


def coriolis_matrix(tree: Tree, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Matrix C(q, dq) of eq. (1) in Christoffel's form, (..., n, n): dM/dt - 2 C is skew.

    The velocity torque is a quadratic form of the velocities, and C its symmetric bilinear form.
    """
    places, speeds = _parts(q), _parts(dq)
    whole = _velocity_torques(tree, places, speeds)
    columns = []
    for k in range(tree.n):
        unit = [float(j == k) for j in range(tree.n)]
        more = _velocity_torques(tree, places, [total(a, b) for a, b in zip(speeds, unit)])
        own = _velocity_torques(tree, places, unit)
        columns.append(_stacked([0.5 * total(a, -1.0 * b, -1.0 * c)
                                 for a, b, c in zip(more, whole, own)], q))
    return np.stack(columns, axis=-1)


def mass_matrix(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Mass matrix M(q) of eq. (1), (..., n, n), without rotors."""
    rows = mass_rows(tree, _parts(q))
    return np.stack([_stacked(row, q) for row in rows], axis=-2)


def mass_rows(tree: Tree, q: Sequence[Scalar]) -> list[list[Scalar]]:
    """Mass matrix as rows of scalars, from what each joint and all that it carries weigh as one.

    Composite rigid bodies: R. Featherstone, Rigid Body Dynamics Algorithms, section 6.2.
    """
    n, local = tree.n, _local_poses(tree, q)
    rows: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    bodies = [_link(tree, k) for k in range(n)]
    for k in reversed(range(n)):
        push, twist = _force_of_unit_acceleration(bodies[k], tree.slides[k])
        rows[k][k] = push[2] if tree.slides[k] else twist[2]
        at, j = k, tree.parents[k]
        if j >= 0:
            bodies[j] = _joined(bodies[j], _moved(bodies[k], *local[k]))
        while j >= 0:
            push, twist = _moved_force(push, twist, *local[at])
            rows[j][k] = rows[k][j] = push[2] if tree.slides[j] else twist[2]
            at, j = j, tree.parents[j]
    return rows


def forward_dynamics(tree: Tree, q: np.ndarray, dq: np.ndarray, torque: np.ndarray,
                     armature: np.ndarray | float = 0.0) -> np.ndarray:
    """Accelerations under some torques: eq. (1) solved for ddq.

    Parameters
    ----------
    tree : Tree
        The links.
    q, dq, torque : ndarray, shape (..., n)
        Positions, velocities, torques on the joint side.
    armature : array_like, shape (n,)
        What the rotors add to the diagonal of the mass matrix: inertia times squared gear ratio
        [kg m^2].

    """
    places, n = _parts(q), tree.n
    bias = _bias_torques(tree, places, _parts(dq))
    more = _parts(armature + np.zeros(n))
    rows = mass_rows(tree, places)
    matrix = [[total(rows[j][k], more[k]) if j == k else rows[j][k] for k in range(n)]
              for j in range(n)]
    left = [total(one, times(-1.0, other)) for one, other in zip(_parts(torque), bias)]
    return _stacked(solve_symmetric(matrix, left), q)


def solve_symmetric(matrix: Sequence[Sequence[Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """Solution of a positive definite system by its L D L' factors, without pivots."""
    n = len(right)
    low: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    pivot: list[Scalar] = [0.0] * n
    for j in range(n):
        pivot[j] = total(matrix[j][j], *(times(-1.0, times(times(low[j][k], low[j][k]), pivot[k]))
                                         for k in range(j)))
        for i in range(j + 1, n):
            left = total(matrix[i][j], *(times(-1.0, times(times(low[i][k], low[j][k]), pivot[k]))
                                         for k in range(j)))
            low[i][j] = _over(left, pivot[j])
    x: list[Scalar] = []
    for i in range(n):
        x.append(total(right[i], *(times(-1.0, times(low[i][k], x[k])) for k in range(i))))
    x = [_over(part, pivot[i]) for i, part in enumerate(x)]
    for i in reversed(range(n)):
        x[i] = total(x[i], *(times(-1.0, times(low[k][i], x[k])) for k in range(i + 1, n)))
    return x


def kinetic_energy(tree: Tree, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Kinetic energy of the links [J], (...): half of dq' M(q) dq."""
    return 0.5 * np.einsum("...j,...jk,...k->...", dq, mass_matrix(tree, q), dq)


def potential_energy(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Potential energy of the links [J], (...), zero where their centres are in the base."""
    places, gravity = poses(tree, _parts(q)), numbers(tree.gravity)
    parts = [dot(gravity, added(scaled(numbers(tree.mass[k]), place),
                                product(turn, numbers(tree.moment[k]))))
             for k, (turn, place) in enumerate(places)]
    return -1.0 * total(*parts) + 0.0 * np.asarray(q)[..., 0]


def poses(tree: Tree, q: Sequence[Scalar]) -> list[tuple[Rows, Three]]:
    """Rotation and origin of the frame of every joint, in the frame of the base."""
    found: list[tuple[Rows, Three]] = []
    for k, (turn, place) in enumerate(_local_poses(tree, q)):
        if tree.parents[k] >= 0:
            before, origin = found[tree.parents[k]]
            place = added(origin, product(before, place))
            columns = [product(before, column) for column in zip(*turn)]
            turn = tuple(zip(*columns))
        found.append((turn, place))
    return found


def _torques(tree: Tree, q: Sequence[Scalar], dq: Sequence[Scalar], ddq: Sequence[Scalar],
             gravity: Three, rotors: Rotors | None = None) -> list[Scalar]:
    """Torques of every joint for a motion: outwards the accelerations, inwards the forces."""
    n, local = tree.n, _local_poses(tree, q)
    links = [_link(tree, k) for k in range(n)]
    motion: list[tuple[Three, Three, Three]] = []  # angular velocity, its rate, acceleration
    force: list[Three] = []
    moment: list[Three] = []
    base = ZERO, ZERO, scaled(-1.0, gravity)
    for k, (turn, place) in enumerate(local):
        before = motion[tree.parents[k]] if tree.parents[k] >= 0 else base
        motion.append(_carried(before, turn, place, dq[k], ddq[k], tree.slides[k]))
        spin, rate, pull = motion[-1]
        mass, first, inertia = links[k]
        force.append(added(scaled(mass, pull), _swing(spin, rate, first)))
        moment.append(added(product(inertia, rate), cross(spin, product(inertia, spin)),
                            cross(first, pull)))
    of_rotor = [0.0] * n
    if rotors is not None:
        of_rotor = _add_rotors(tree, local, [base, *motion], dq, ddq, rotors, moment)
    torque: list[Scalar] = [0.0] * n
    for k in reversed(range(n)):
        turn, place = local[k]
        torque[k] = total(force[k][2] if tree.slides[k] else moment[k][2], of_rotor[k])
        j = tree.parents[k]
        if j >= 0:
            push, twist = _moved_force(force[k], moment[k], turn, place)
            force[j], moment[j] = added(force[j], push), added(moment[j], twist)
    return torque


def _carried(before: tuple[Three, Three, Three], turn: Rows, place: Three, speed: Scalar,
             rate: Scalar, slides: bool) -> tuple[Three, Three, Three]:
    """Angular velocity, its rate, and acceleration of a frame, from those of its parent."""
    spin, turning, pull = before
    pull = transposed_product(turn, added(pull, _swing(spin, turning, place)))
    spin, turning = (transposed_product(turn, part) for part in (spin, turning))
    along, faster = scaled(speed, _Z), scaled(rate, _Z)
    if slides:
        twice = scaled(2.0, cross(spin, along))
        return spin, turning, added(pull, twice, faster)
    return added(spin, along), added(turning, faster, cross(spin, along)), pull


def _swing(spin: Three, turning: Three, arm: Three) -> Three:
    """Acceleration of a point that a turning frame carries, from that of its origin."""
    return added(cross(turning, arm), cross(spin, cross(spin, arm)))


def _moved_force(push: Three, twist: Three, turn: Rows, place: Three) -> tuple[Three, Three]:
    """Force and moment about the origin of a frame, as its parent sees them."""
    push = product(turn, push)
    return push, added(product(turn, twist), cross(place, push))


def _force_of_unit_acceleration(body: Body, slides: bool) -> tuple[Three, Three]:
    """Force and moment that accelerate a body along, or about, the z axis."""
    mass, (x, y, _), inertia = body
    across = times(-1.0, y), x, 0.0
    if slides:
        return scaled(mass, _Z), scaled(-1.0, across)
    return across, tuple(row[2] for row in inertia)


def _moved(body: Body, turn: Rows, place: Three) -> Body:
    """Mass, first moment and inertia of a body about the origin of the frame's parent."""
    mass, first, inertia = body
    before = product(turn, first)
    after = added(before, scaled(mass, place))
    arms = tuple(map(times, added(before, after), place))
    turned = [product(inertia, row) for row in turn]
    upper = {(i, j): total(dot(turn[j], turned[i]), *(
        (arms[k] for k in range(3) if k != i) if i == j else
        (times(-1.0, times(before[i], place[j])), times(-1.0, times(place[i], after[j])))))
        for i in range(3) for j in range(i, 3)}
    return mass, after, tuple(tuple(upper[min(i, j), max(i, j)] for j in range(3))
                              for i in range(3))


def _joined(one: Body, other: Body) -> Body:
    """Two bodies as one, both in the same frame."""
    return (total(one[0], other[0]), added(one[1], other[1]),
            tuple(map(added, one[2], other[2])))


def _add_rotors(tree: Tree, local: Sequence[tuple[Rows, Three]],
                motion: Sequence[tuple[Three, Three, Three]], dq: Sequence[Scalar],
                ddq: Sequence[Scalar], rotors: Rotors, moment: list[Three]) -> list[Scalar]:
    """Torques of the rotors on their joints; their reactions go to the links that carry them."""
    torque = []
    for k, (turn, _) in enumerate(local):
        j, ratio = tree.parents[k], numbers(rotors.gear_ratio[k])
        inertia = numbers(rotors.inertia[k])
        spin, turning, _ = motion[j + 1]
        axis = tuple(row[2] for row in turn)  # of the joint, in the frame of its parent
        speed, faster = (times(inertia, times(ratio, rate[k])) for rate in (dq, ddq))
        torque.append(times(ratio, total(times(inertia, dot(axis, turning)), faster)))
        if j >= 0:
            moment[j] = added(moment[j], scaled(faster, axis), cross(spin, scaled(speed, axis)))
    return torque


def _link(tree: Tree, k: int) -> Body:
    return numbers(tree.mass[k]), numbers(tree.moment[k]), numbers(tree.inertia[k])


def _local_poses(tree: Tree, q: Sequence[Scalar]) -> list[tuple[Rows, Three]]:
    """Rotation and origin of the frame of every joint, in the frame of its parent."""
    found = []
    for k in range(tree.n):
        fixed, place = numbers(tree.rotation[k]), numbers(tree.offset[k])
        if tree.slides[k]:
            place = added(place, scaled(q[k], tuple(row[2] for row in fixed)))
            found.append((fixed, place))
            continue
        cosine, sine = np.cos(q[k]), np.sin(q[k])
        found.append((tuple((total(times(a, cosine), times(b, sine)),
                             total(times(b, cosine), times(-a, sine)), c)
                            for a, b, c in fixed), place))
    return found


def _bias_torques(tree: Tree, q: Sequence[Scalar], dq: Sequence[Scalar]) -> list[Scalar]:
    return _torques(tree, q, dq, [0.0] * tree.n, numbers(tree.gravity))


def _velocity_torques(tree: Tree, q: Sequence[Scalar], dq: Sequence[Scalar]) -> list[Scalar]:
    return _torques(tree, q, dq, [0.0] * tree.n, ZERO)


def _over(part: Scalar, pivot: Scalar) -> Scalar:
    return 0.0 if isinstance(part, float) and part == 0.0 else part / pivot


def _parts(x: Any) -> list[Scalar]:
    """Entries of the last axis of an array (..., n)."""
    x = np.asanyarray(x)
    return [x[..., k] for k in range(x.shape[-1])]


def _stacked(parts: Sequence[Scalar], like: Any) -> np.ndarray:
    """Array (..., n) of some entries, each as long as those of another array."""
    neutral = 0.0 * np.asanyarray(like)[..., 0]
    return np.stack([part + neutral for part in parts], axis=-1)
