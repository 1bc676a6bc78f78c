"""Links of the sampled robot: a tree of rigid links whose numbers are parameters of the block.

Torques are joint side [N m]; the mass matrix is that of all links, without the rotors.  A planar
chain, as in the paper, is the tree whose joints all turn about the z axis of the base.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.rigid_body import dynamics
from clie_blocks.rigid_body.motor_coupling import (
    Matrix,
    coupling_of,
    mapped,
    motor_mass_rows,
    motor_torques,
)
from clie_blocks.rigid_body.scalars import added, dot, numbers, scaled, times, total
from clie_blocks.rigid_body.tree import Tree, steiner

_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_ZZ = _UPPER.index((2, 2))
_ROUND_OFF = 1e-13
_WHOLE = (0.0, 1.0, -1.0)  # entries of a rotation that cost nothing


@dataclasses.dataclass(frozen=True)
class Layout:
    """What of the links decides a program: the tree, its terms, and which numbers are constants.

    Parameters
    ----------
    parents, slides : tuple
        As in `Tree`.
    constants : tuple of (str, tuple)
        Entries of each array of `Links` that no parameter changes; None where one does.
    known, has_gravity, has_coupling, motor_coupling
        As in `Links`.

    """

    parents: tuple[int, ...]
    slides: tuple[bool, ...]
    constants: tuple[tuple[str, tuple[float | None, ...]], ...]
    known: bool
    has_gravity: bool
    has_coupling: bool
    motor_coupling: Matrix | None = None

    def links(self, params: Mapping[str, Any]) -> Links:
        """Return the links with the parameters of a block, numbers or symbols."""
        arrays = {name: np.asanyarray(params[f"links.{name}"]) for name in Links.parameters}
        for name, entries in self.constants:
            arrays[name] = _with_constants(arrays[name], entries)
        return Links(self.parents, self.slides, known=self.known, has_gravity=self.has_gravity,
                     has_coupling=self.has_coupling, motor_coupling=self.motor_coupling,
                     **arrays)

    def sample_parameters(self) -> dict[str, np.ndarray]:
        """Parameters of the right shapes, harmless for a check of the compiled program."""
        n = len(self.parents)
        links = planar_links(*np.ones((4, n)))
        values = {name: np.asarray(getattr(links, name)) for name in Links.parameters}
        for name, entries in self.constants:
            values[name] = np.array([1.0 if x is None else x for x in entries]).reshape(
                values[name].shape)
        return values


@dataclasses.dataclass(frozen=True, eq=False)
class Links:
    """Links of the robot, and which of their terms the nominal model holds.

    Parameters
    ----------
    parents, slides : tuple
        Of the joints, as in `Tree`.
    rotation, offset : ndarray, shape (n, 3, 3), (n, 3)
        Frame of each joint, whose z is its axis, in that of its parent [m].
    mass : ndarray, shape (n,)
        Of each link [kg].
    com : ndarray, shape (n, 3)
        Centre of mass in the frame of the joint [m].
    inertia : ndarray, shape (n, 6)
        About the centre of mass, xx, xy, xz, yy, yz, zz [kg m^2].
    along : ndarray, shape (n, 3)
        From each joint to the next one, of the last joint to the tip [m].
    gravity : ndarray, shape (3,)
        In the frame of the base [m/s^2].
    bearing_damping : ndarray, shape (n,)
        Of the joints [N m s/rad]; zero where not stated.
    diagonal : ndarray, shape (n,)
        Diagonal of the mass matrix at the pose of the experiments [kg m^2].
    known : bool
        The link data are stated.
    has_gravity, has_coupling : bool
        Terms of the nominal model.
    motor_coupling : tuple of tuple, optional
        Matrix C of motors that turn several joints, see `clie_blocks.rigid_body.motor_coupling`:
        positions and torques of all functions here are then those of the motors.

    """

    parents: tuple[int, ...]
    slides: tuple[bool, ...]
    rotation: np.ndarray
    offset: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    along: np.ndarray
    gravity: np.ndarray
    bearing_damping: np.ndarray
    diagonal: np.ndarray
    known: bool
    has_gravity: bool
    has_coupling: bool
    motor_coupling: Matrix | None = None

    parameters: ClassVar[tuple[str, ...]] = (
        "rotation", "offset", "mass", "com", "inertia", "along", "gravity", "bearing_damping",
        "diagonal")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.parents)

    @property
    def g(self) -> float:
        """Acceleration of gravity [m/s^2]."""
        return float(np.linalg.norm(self.gravity))

    @property
    def length(self) -> np.ndarray:
        """Distance from each joint to the next one, of the last joint to the tip (n,) [m]."""
        return np.linalg.norm(self.along, axis=1)

    @property
    def layout(self) -> Layout:
        """What of the links decides a program: geometry that is zero costs nothing in it."""
        whole = {"rotation": _WHOLE, "offset": (0.0,), "com": (0.0,), "inertia": (0.0,),
                 "along": (0.0,), "gravity": (0.0,)}
        constants = tuple((name, tuple(float(x) if x in values else None
                                       for x in np.ravel(getattr(self, name))))
                          for name, values in whole.items())
        return Layout(self.parents, self.slides, constants, self.known, self.has_gravity,
                      self.has_coupling, self.motor_coupling)

    @property
    def tree(self) -> Tree:
        """The links as a tree; of parameters that are symbols, a tree of symbols."""
        mass, com = numbers(self.mass), numbers(self.com)
        about_com = numbers(self.inertia)
        moment = [scaled(m, c) for m, c in zip(mass, com)]
        inertia = [_about_joint(*of_link) for of_link in zip(about_com, com, moment)]
        free = np.full(self.n, np.inf)
        return Tree(tuple(f"joint{k + 1}" for k in range(self.n)), self.parents, self.slides,
                    self.rotation, self.offset, self.mass, np.array(moment, object),
                    np.array(inertia, object), self.gravity, -free, free, self.along[-1])

    @property
    def com_along(self) -> np.ndarray:
        """Distance of each centre of mass from its joint, along the link (n,) [m]."""
        length = np.where(self.length > 0.0, self.length, 1.0)
        return (self.com * self.along).sum(axis=1) / length

    @property
    def spin_inertia(self) -> np.ndarray:
        """Inertia of each link about its centre of mass and the axis of its joint [kg m^2]."""
        return self.inertia[:, _ZZ]

    @property
    def is_planar(self) -> bool:
        """Whether they are a chain in one vertical plane, as `planar_links` makes."""
        if self.motor_coupling is not None:
            return False
        chain = planar_links(self.along[:, 0], self.mass, self.com[:, 0], self.spin_inertia,
                             g=-self.gravity[1])
        return all(np.array_equal(getattr(self, name), getattr(chain, name)) for name in (
            "parents", "slides", "rotation", "offset", "com", "inertia", "along", "gravity"))

    def with_changes(self, *, mass: Any = None, com: Any = None, length: Any = None,
                inertia: Any = None) -> Links:
        """Return the links with changes of their numbers, (n,) each.

        All are relative; a centre of mass moves along its link by a share of the length.
        """
        links, n = self, self.n
        if mass is not None:
            links = dataclasses.replace(links, mass=self.mass * (1.0 + mass))
        if com is not None:
            centres = [added(numbers(self.com[k]), scaled(com[k], numbers(self.along[k])))
                       for k in range(n)]
            links = dataclasses.replace(links, com=np.array(centres))
        if length is not None:
            longer = [1.0 + length[k] for k in range(n)]
            links = dataclasses.replace(links, along=_scaled_rows(longer, self.along),
                                        offset=_scaled_rows(
                                            [1.0 if j < 0 else longer[j] for j in self.parents],
                                            self.offset))
        if inertia is not None:
            links = dataclasses.replace(links, inertia=_scaled_rows(
                [1.0 + inertia[k] for k in range(n)], self.inertia))
        return links

    def with_gravity(self, gravity: Any) -> Links:
        """Return the same links under another gravity (3,), in the frame of the base [m/s^2]."""
        return dataclasses.replace(self, gravity=gravity)

    def at_joints(self, *motion: np.ndarray) -> tuple[np.ndarray, ...]:
        """Positions of the joints, or their derivatives (..., n), from those of the motors."""
        coupling = self.motor_coupling
        return motion if coupling is None else tuple(mapped(coupling, x) for x in motion)

    def at_motors(self, torque: np.ndarray) -> np.ndarray:
        """Torque on the motors, times their gear ratios, from that on the joints (..., n)."""
        coupling = self.motor_coupling
        return torque if coupling is None else motor_torques(coupling, torque)


def turn_gravity(links: Links) -> Links:
    """Return the same links under gravity that lies a quarter turn ahead, about z of the base."""
    x, y, _ = numbers(links.gravity)
    return links.with_gravity(np.array([y, times(-1.0, x), 0.0]))


def weights(links: Links) -> np.ndarray:
    """Moment of each link of a planar chain, and of all it carries at its end (n,) [N m]."""
    behind = np.cumsum(links.mass[::-1])[::-1] - links.mass
    return links.g * (links.mass * links.com_along + links.length * behind)


def no_links(n: int) -> Links:
    """Joints that carry nothing that weighs or couples."""
    zero = np.zeros(n)
    return dataclasses.replace(planar_links(zero, zero, zero, zero), known=False)


def planar_links(length: ArrayLike, mass: ArrayLike, com: ArrayLike, inertia: ArrayLike, *,
                 bearing_damping: ArrayLike = 0.0, g: float = 9.81, has_gravity: bool = False,
                 has_coupling: bool = False, diagonal: ArrayLike = 0.0) -> Links:
    """Chain of links in one vertical plane, as in section 5: q1 = 0 is horizontal.

    Parameters
    ----------
    length, mass, com : array_like, shape (n,)
        Of the links; centres of mass lie on them, at these distances from their joints [m, kg, m].
    inertia : array_like, shape (n,)
        About the centres of mass [kg m^2].
    bearing_damping, diagonal : array_like, shape (n,)
        As in `Links`.
    g : float
        Acceleration of gravity [m/s^2].
    has_gravity, has_coupling : bool
        As in `Links`.

    """
    length = np.asarray(length, float)
    n = length.size
    along, centre, spin = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, len(_UPPER)))
    along[:, 0], centre[:, 0], spin[:, _ZZ] = length, com, inertia
    offset = np.concatenate((np.zeros((1, 3)), along[:-1]))
    return Links(tuple(range(-1, n - 1)), (False,) * n, np.tile(np.eye(3), (n, 1, 1)), offset,
                 np.asarray(mass, float) + np.zeros(n), centre, spin, along,
                 np.array([0.0, -g, 0.0]), np.asarray(bearing_damping, float) + np.zeros(n),
                 np.asarray(diagonal, float) + np.zeros(n), known=True, has_gravity=has_gravity,
                 has_coupling=has_coupling)


def tree_links(tree: Tree, *, bearing_damping: ArrayLike = 0.0, has_gravity: bool = True,
               has_coupling: bool = True, diagonal: ArrayLike = 0.0,
               motor_coupling: ArrayLike | None = None) -> Links:
    """Links of any arm, as read from a robot description.

    Parameters
    ----------
    tree : Tree
        The links.
    bearing_damping, diagonal : array_like, shape (n,)
        As in `Links`.
    has_gravity, has_coupling, motor_coupling
        As in `Links`.

    """
    n, com = tree.n, tree.com
    coupling = None if motor_coupling is None else coupling_of(motor_coupling, n)
    about_com = [_clean(about_joint - m * steiner(c), np.abs(about_joint).max())
                 for about_joint, m, c in zip(tree.inertia, tree.mass, com)]
    along = [next((tree.offset[j] for j in range(n) if tree.parents[j] == k), com[k])
             for k in range(n)]
    along[-1] = tree.tip
    return Links(tree.parents, tree.slides, tree.rotation, tree.offset, tree.mass, com,
                 np.array([[inertia[i, j] for i, j in _UPPER] for inertia in about_com]),
                 np.array(along), tree.gravity, np.asarray(bearing_damping, float) + np.zeros(n),
                 np.asarray(diagonal, float) + np.zeros(n), known=True, has_gravity=has_gravity,
                 has_coupling=has_coupling, motor_coupling=coupling)


def mass_rows(links: Links, q: np.ndarray) -> list[list[Any]]:
    """Mass matrix as n rows of n entries [kg m^2]; q (..., n) may hold a time series."""
    none = 0.0 * q[..., 0]
    at, = links.at_joints(q)
    rows = dynamics.mass_rows(links.tree, [at[..., k] for k in range(links.n)])
    if links.motor_coupling is not None:
        rows = motor_mass_rows(links.motor_coupling, rows)
    return [[entry + none for entry in row] for row in rows]


def gravity_torque(links: Links, q: np.ndarray) -> np.ndarray:
    """Weight of the links [N m] for q (..., n)."""
    return links.at_motors(dynamics.gravity_torque(links.tree, *links.at_joints(q)))


def coriolis_torque(links: Links, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Coriolis and centrifugal torque of the links [N m]; zero for one."""
    if links.n == 1:
        return 0.0 * q
    return links.at_motors(dynamics.velocity_torque(links.tree, *links.at_joints(q, dq)))


def bias_torque(links: Links, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Coriolis torque [N m], with the weight where gravity acts."""
    if not links.has_gravity:
        return coriolis_torque(links, q, dq)
    if links.n == 1:
        return gravity_torque(links, q)
    return links.at_motors(dynamics.bias_torque(links.tree, *links.at_joints(q, dq)))


def coupling_torque(links: Links, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque of inertia coupling, of the change of inertia, and Coriolis [N m]."""
    if links.n == 1:
        return 0.0 * q
    return _weightless_torque(links, q, dq, ddq) - links.diagonal * ddq


def inertial_torque(links: Links, q: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Mass matrix times acceleration [N m], shape (..., n)."""
    return _weightless_torque(links, q, 0.0 * q, ddq)


def tip_load_torque(links: Links, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque of a unit mass at the tip [N m/kg], with its weight where gravity acts."""
    unit = unit_tip_links(links)
    if not links.has_gravity:
        return _weightless_torque(unit, q, dq, ddq)
    at, rate, rise = links.at_joints(q, dq, ddq)
    return links.at_motors(dynamics.inverse_dynamics(unit.tree, at, rate, rise))


def _weightless_torque(links: Links, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
                       ) -> np.ndarray:
    """Torque that a motion takes without weight [N m], shape (..., n)."""
    weightless = links.tree.with_gravity((0.0, 0.0, 0.0))
    at, rate, rise = links.at_joints(q, dq, ddq)
    return links.at_motors(dynamics.inverse_dynamics(weightless, at, rate, rise))


def unit_tip_links(links: Links) -> Links:
    """Links of the same geometry whose only mass is 1 kg at the tip."""
    com = np.where(np.arange(links.n)[:, None] == links.n - 1, links.along, 0.0)
    return dataclasses.replace(links, mass=np.eye(links.n)[-1], com=com,
                               inertia=np.zeros((links.n, len(_UPPER))))


def _about_joint(about_com: Any, com: Any, moment: Any) -> list[list[Any]]:
    """Inertia of a link about its joint, as rows, by Steiner's theorem."""
    square = dot(com, moment)
    upper = {(i, j): total(about_com[k], square if i == j else 0.0,
                           times(-1.0, times(com[i], moment[j])))
             for k, (i, j) in enumerate(_UPPER)}
    return [[upper[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]


def _scaled_rows(factors: list[Any], rows: np.ndarray) -> np.ndarray:
    """Rows of an array, each times a factor of its own; zeros stay numbers."""
    return np.array([scaled(factor, numbers(row)) for factor, row in zip(factors, rows)])


def _clean(array: np.ndarray, scale: float) -> np.ndarray:
    """Array in which what differs from zero by rounding is zero."""
    return np.where(np.abs(array) < _ROUND_OFF * scale, 0.0, array)


def _with_constants(array: np.ndarray, entries: tuple[float | None, ...]) -> np.ndarray:
    """Array, of numbers or symbols, some of whose entries are constants."""
    changed = array.copy()
    for place, entry in zip(np.ndindex(*array.shape), entries):
        if entry is not None:
            changed[place] = entry
    return changed
