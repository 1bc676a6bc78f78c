"""Trees of rigid links: what a robot is made of, joint by joint."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError, nearest
from clie_blocks.rigid_body.rotations import rotation_from_z

REVOLUTE, PRISMATIC = "revolute", "prismatic"
GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, in the frame of the base
_ROUNDED = 0.01  # of the largest moment of inertia: files hold two or three digits


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """A link and the joint that carries it.

    Parameters
    ----------
    name : str
        Of the joint.
    parent : str or None
        Joint that carries the one before; None for the base.
    rotation : array_like, shape (3, 3)
        From the frame of this joint to that of its parent, at zero.
    offset : array_like, shape (3,)
        Origin of this joint in the frame of its parent [m].
    axis : array_like, shape (3,)
        Of the joint, in its own frame.
    mass : float
        Of the link [kg].
    com : array_like, shape (3,)
        Centre of mass in the frame of the joint [m].
    inertia : array_like, shape (3, 3)
        About the centre of mass, in the frame of the joint [kg m^2].
    kind : str
        ``revolute`` or ``prismatic``.
    lower, upper : float
        Limits [rad or m].
    link : str
        Name of the link, for messages.

    """

    name: str
    parent: str | None
    rotation: np.ndarray
    offset: np.ndarray
    axis: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    kind: str = REVOLUTE
    lower: float = -np.inf
    upper: float = np.inf
    link: str = ""


@dataclasses.dataclass(frozen=True, eq=False)
class Tree:
    """Links of a robot whose joints turn about, or slide along, the z axis of their frames.

    Masses, moments and inertias may be symbols of a diagram; torques are linear in them.

    Parameters
    ----------
    names : tuple of str
        Joints, each behind the one that carries it.
    parents : tuple of int
        Index of the joint that carries each; -1 is the base.
    slides : tuple of bool
        Which joints are prismatic.
    rotation, offset : ndarray, shape (n, 3, 3), (n, 3)
        Frame of each joint in that of its parent, at zero [m].
    mass, moment, inertia : ndarray, shape (n,), (n, 3), (n, 3, 3)
        Of the links, in the frames of their joints: mass [kg], mass times centre of mass [kg m],
        inertia about the origin of the joint [kg m^2].
    gravity : ndarray, shape (3,)
        In the frame of the base [m/s^2].
    lower, upper : ndarray, shape (n,)
        Limits [rad or m].
    tip : ndarray, shape (3,)
        Where a load would sit, in the frame of the last joint [m].

    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    slides: tuple[bool, ...]
    rotation: np.ndarray
    offset: np.ndarray
    mass: np.ndarray
    moment: np.ndarray
    inertia: np.ndarray
    gravity: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    tip: np.ndarray

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.names)

    @property
    def com(self) -> np.ndarray:
        """Centres of mass in the frames of the joints, (n, 3) [m]; zero for massless links."""
        mass = np.where(self.mass > 0.0, self.mass, 1.0)
        return np.where(self.mass[:, None] > 0.0, self.moment / mass[:, None], 0.0)

    def with_gravity(self, gravity: Sequence[float]) -> Tree:
        """Return the same links under another gravity [m/s^2], in the frame of the base."""
        return dataclasses.replace(self, gravity=np.array(gravity, float))

    def behind(self, k: int) -> tuple[int, ...]:
        """Joints that joint k moves: itself, and all that it carries."""
        carried = {k}
        for j in range(k + 1, self.n):
            if self.parents[j] in carried:
                carried.add(j)
        return tuple(sorted(carried))


def tree(bodies: Sequence[Body], gravity: ArrayLike = GRAVITY,
         tip: ArrayLike | None = None) -> Tree:
    """Return the tree of some bodies, in frames whose z is the axis of the joint.

    Parameters
    ----------
    bodies : sequence of Body
        In any order.
    gravity : array_like, shape (3,)
        In the frame of the base [m/s^2].
    tip : array_like, shape (3,), optional
        Where a load would sit, in the frame of the last joint [m]; by default at the centre of
        mass of its link.

    Raises
    ------
    ClieError
        If a parent is missing, joints carry each other, an axis is zero, or a link could not
        exist: a mass below zero, or moments of inertia that no distribution of mass has.

    """
    if not bodies:
        raise ClieError("a robot has at least one joint that moves; all of these are fixed")
    ordered = _in_order(bodies)
    turns: dict[str | None, np.ndarray] = {None: np.eye(3)}
    columns: list[tuple[np.ndarray | float, ...]] = []
    places: dict[str | None, int] = {None: -1}
    for k, body in enumerate(ordered):
        _check_body(body)
        places[body.name] = k
        turn = turns[body.name] = rotation_from_z(np.asarray(body.axis, float),
                                                  f"the axis of joint {body.name!r}")
        before, mass = turns[body.parent].T, float(body.mass)
        com = _clean(turn.T @ np.asarray(body.com, float))
        about_com = turn.T @ np.asarray(body.inertia, float) @ turn
        columns.append((_clean(before @ np.asarray(body.rotation, float) @ turn),
                        _clean(before @ np.asarray(body.offset, float)), mass, mass * com,
                        _clean(about_com + mass * steiner(com)), body.lower, body.upper))
    rotation, offset, masses, moment, inertia, lower, upper = (
        np.array(column, float) for column in zip(*columns))
    last = ordered[-1]
    return Tree(tuple(body.name for body in ordered),
                tuple(places[body.parent] for body in ordered),
                tuple(body.kind == PRISMATIC for body in ordered), rotation, offset, masses,
                moment, inertia, np.array(gravity, float), lower, upper,
                _clean(turn.T @ np.asarray(last.com if tip is None else tip, float)))


def steiner(arm: np.ndarray) -> np.ndarray:
    """Inertia of a unit mass at the end of an arm (3,), about its beginning [m^2]."""
    return arm @ arm * np.eye(3) - np.outer(arm, arm)


def _in_order(bodies: Sequence[Body]) -> list[Body]:
    """Bodies behind those that carry them, otherwise in the order in which they came."""
    names = [body.name for body in bodies]
    for name in names:
        if names.count(name) > 1:
            raise ClieError(f"two joints are called {name!r}; rename one")
    for body in bodies:
        if body.parent is not None and body.parent not in names:
            raise ClieError(f"joint {body.name!r} is carried by {body.parent!r}, which is no "
                            f"joint; {nearest(body.parent, names)}")
    ordered: list[Body] = []
    waiting = list(bodies)
    while waiting:
        placed = {None, *(body.name for body in ordered)}
        ready = [body for body in waiting if body.parent in placed]
        if not ready:
            loop = ", ".join(body.name for body in waiting)
            raise ClieError(f"joints {loop} carry each other; a tree has no loop: cut it, and "
                            "model the closing link as a load")
        ordered.append(ready[0])
        waiting.remove(ready[0])
    return ordered


def _check_body(body: Body) -> None:
    """Refuse a link that could not exist."""
    link = body.link or body.name
    if not body.mass >= 0.0:
        raise ClieError(f"the mass of link {link!r} is {body.mass:g} kg; a mass is 0 or more")
    inertia = np.asarray(body.inertia, float)
    if not np.allclose(inertia, inertia.T, rtol=1e-6, atol=1e-12):
        raise ClieError(f"the inertia of link {link!r} is not symmetric; write Ixy once")
    principal = np.linalg.eigvalsh(inertia)
    room = _ROUNDED * principal[-1] + 1e-12
    if principal[0] < -room:
        raise ClieError(f"the inertia of link {link!r} has a moment of {principal[0]:.3g} kg m^2; "
                        "about its centre of mass no moment is negative: check the signs of Ixy, "
                        "Ixz, Iyz, and the point that it refers to")
    if principal[2] > principal[0] + principal[1] + room:
        raise ClieError(
            f"the moments of inertia of link {link!r}, {_three(principal)} kg m^2, belong to no "
            "body: the largest exceeds the sum of the others; check the point and the axes that "
            "they refer to")


def _three(values: np.ndarray) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _clean(array: np.ndarray) -> np.ndarray:
    """Array whose entries next to 0, 1 and -1 are these: they then cost nothing."""
    whole = np.round(array)
    return np.where(np.abs(array - whole) < 1e-12, whole, array) + 0.0
