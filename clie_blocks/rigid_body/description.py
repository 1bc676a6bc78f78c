"""What a robot description says of links and joints, before it is a tree.

Joints that are fixed or held merge the links that they join; those off the way to a tip are held
where they stand.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from clie_blocks.errors import ClieError, nearest
from clie_blocks.rigid_body.rotations import turn_about, unit
from clie_blocks.rigid_body.tree import PRISMATIC, Body, steiner

FIXED = "fixed"


@dataclasses.dataclass(frozen=True, eq=False)
class Pose:
    """Frame in another one: rotation (3, 3) and origin (3,) [m]."""

    rotation: np.ndarray = dataclasses.field(default_factory=lambda: np.eye(3))
    origin: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))

    def then(self, other: Pose) -> Pose:
        """Return the pose of a frame whose pose in this one is the other."""
        return Pose(self.rotation @ other.rotation, self.origin + self.rotation @ other.origin)


@dataclasses.dataclass(frozen=True, eq=False)
class Inertial:
    """Mass [kg], first moment (3,) [kg m] and inertia (3, 3) about the origin [kg m^2]."""

    mass: float = 0.0
    moment: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 3)))

    def __add__(self, other: Inertial) -> Inertial:
        """Return both together, in the same frame."""
        return Inertial(self.mass + other.mass, self.moment + other.moment,
                        self.inertia + other.inertia)

    def seen_from(self, pose: Pose) -> Inertial:
        """Return the same link in the frame in which its own frame has a pose."""
        com, about_com = self.about_com()
        there = pose.origin + pose.rotation @ com
        return Inertial(self.mass, self.mass * there,
                        pose.rotation @ about_com @ pose.rotation.T + self.mass * steiner(there))

    def about_com(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass [m] and inertia about it [kg m^2]."""
        com = self.moment / self.mass if self.mass else np.zeros(3)
        return com, self.inertia - self.mass * steiner(com)


@dataclasses.dataclass(frozen=True, eq=False)
class Joint:
    """A joint between two links.

    Parameters
    ----------
    name : str
        Of the joint.
    kind : str
        ``revolute``, ``prismatic`` or ``fixed``.
    parent, child : str
        Links.
    pose : Pose
        Of the frame of the joint in that of the parent, at zero.
    axis : ndarray, shape (3,)
        In the frame of the joint.
    lower, upper : float
        Limits [rad or m].
    obstacle : str
        Why the joint cannot move in a tree, and what helps; it may be held.
    damping, dry_friction, effort, armature : float
        What a file says of the drive, on the joint side: damping [N m s/rad], dry friction and
        largest torque [N m], inertia of the rotor behind the gear [kg m^2].
    gear : float
        Torque at the joint per unit of the command, where a file states a motor; else 1.

    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: np.ndarray
    lower: float = -math.inf
    upper: float = math.inf
    obstacle: str = ""
    damping: float = 0.0
    dry_friction: float = 0.0
    effort: float = math.inf
    armature: float = 0.0
    gear: float = 1.0

    def at(self, position: float) -> Pose:
        """Pose of the child in the frame of the parent, where the joint is held [rad or m]."""
        if self.kind == FIXED or not position:
            return self.pose
        axis = unit(self.axis, f"the axis of joint {self.name!r}")
        if self.kind == PRISMATIC:
            return self.pose.then(Pose(origin=position * axis))
        return self.pose.then(Pose(turn_about(axis, position)))


@dataclasses.dataclass(frozen=True, eq=False)
class _Merged:
    """Joints that move, by name with their carrier and pose; inertials that each joint carries.

    `places` holds the joint that moves each link, and the pose of the link in its frame.
    """

    moving: Mapping[str, tuple[Joint, str | None, Pose]]
    carried: Mapping[str | None, Inertial]
    places: Mapping[str, tuple[str | None, Pose]]


@dataclasses.dataclass(frozen=True, eq=False)
class Description:
    """Links and joints of a robot, as a file states them.

    Parameters
    ----------
    source : str
        The file, for messages.
    links : dict
        Inertial of each link by name, in the frame behind the joint that carries it.
    joints : tuple of Joint
        Joints between them.

    """

    source: str
    links: Mapping[str, Inertial]
    joints: tuple[Joint, ...]

    def bodies(self, base: str | None = None, tip: str | None = None,
               locked: Mapping[str, float] | None = None) -> list[Body]:
        """Return the joints that move, each with all that it carries rigidly.

        Parameters
        ----------
        base, tip : str, optional
            Links between which the joints are kept; by default all joints behind the root.
        locked : mapping of str to float, optional
            Joints that are held, and where [rad or m].

        Raises
        ------
        ClieError
            If the description is no tree, a name is not in it, or a joint cannot move.

        """
        merged = self._merged(base, tip, locked)
        return [self._body(joint, carrier, pose, merged.carried[name])
                for name, (joint, carrier, pose) in merged.moving.items()]

    def point(self, link: str, base: str | None = None, tip: str | None = None,
              locked: Mapping[str, float] | None = None) -> tuple[str | None, np.ndarray]:
        """Return the joint that moves a link, and the link's origin in the frame of it [m].

        See `bodies` for the parameters.
        """
        carrier, pose = self._merged(base, tip, locked).places[link]
        return carrier, pose.origin

    def _merged(self, base: str | None, tip: str | None,
                locked: Mapping[str, float] | None) -> _Merged:
        """Joints that move, with what each carries rigidly."""
        self._check_links()
        held = dict(locked or {})
        names = [joint.name for joint in self.joints]
        for name in held:
            if name not in names:
                raise ClieError(f"{self.source}: there is no joint {name!r} to lock; "
                                f"{nearest(name, names)}")
        root = self._root(base)
        kept = set(names) if tip is None else self._joints_to(root, tip)
        return self._merge(root, held, kept - set(held))

    def _check_links(self) -> None:
        """Each joint joins two links that are there, and none is carried twice."""
        carried: dict[str, str] = {}
        for joint in self.joints:
            for link in (joint.parent, joint.child):
                if link not in self.links:
                    raise ClieError(f"{self.source}: joint {joint.name!r} names link {link!r}, "
                                    f"which is not there; {nearest(link, list(self.links))}")
            if joint.child in carried:
                raise ClieError(f"{self.source}: link {joint.child!r} is carried by joints "
                                f"{carried[joint.child]!r} and {joint.name!r}; a tree has no loop")
            carried[joint.child] = joint.name
        carriers = {joint.child: joint.parent for joint in self.joints}
        for link in self.links:
            way = [link]
            while way[-1] in carriers:
                way.append(carriers[way[-1]])
                if way[-1] in way[:-1]:
                    raise ClieError(f"{self.source}: links {', '.join(way)} carry each other; a "
                                    "tree has no loop: cut it, and model the closing link as a "
                                    "load")

    def _root(self, base: str | None) -> str:
        """Link that stands still: the one that is named, or the one that nothing carries."""
        if base is not None:
            if base not in self.links:
                raise ClieError(f"{self.source}: there is no link {base!r}; "
                                f"{nearest(base, list(self.links))}")
            return base
        carried = {joint.child for joint in self.joints}
        roots = [link for link in self.links if link not in carried]
        if len(roots) != 1:
            names = ", ".join(map(repr, roots)) or "none"
            raise ClieError(f"{self.source}: a robot has one base, this file has {len(roots)} "
                            f"({names}); name the link that stands still: base = ...")
        return roots[0]

    def _joints_to(self, base: str, tip: str) -> set[str]:
        """Joints on the way from the base to a tip."""
        if tip not in self.links:
            raise ClieError(f"{self.source}: there is no link {tip!r}; "
                            f"{nearest(tip, list(self.links))}")
        carrying = {joint.child: joint for joint in self.joints}
        names, link = set(), tip
        while link != base:
            if link not in carrying:
                raise ClieError(f"{self.source}: link {tip!r} is not carried by {base!r}; choose "
                                "a base on its way to the root")
            names.add(carrying[link].name)
            link = carrying[link].parent
        return names

    def _merge(self, root: str, held: Mapping[str, float], free: set[str]) -> _Merged:
        behind: dict[str, list[Joint]] = {}
        for joint in self.joints:
            behind.setdefault(joint.parent, []).append(joint)
        moving: dict[str, tuple[Joint, str | None, Pose]] = {}
        carried: dict[str | None, Inertial] = {None: Inertial()}
        places: dict[str, tuple[str | None, Pose]] = {}

        def add(link: str, carrier: str | None, pose: Pose) -> None:
            carried[carrier] = carried[carrier] + self.links[link].seen_from(pose)
            places[link] = carrier, pose
            for joint in behind.get(link, []):
                if joint.kind == FIXED or joint.name not in free:
                    add(joint.child, carrier, pose.then(joint.at(held.get(joint.name, 0.0))))
                    continue
                if joint.obstacle:
                    raise ClieError(f"{self.source}: joint {joint.name!r} {joint.obstacle}")
                moving[joint.name] = joint, carrier, pose.then(joint.pose)
                carried[joint.name] = Inertial()
                add(joint.child, joint.name, Pose())

        add(root, None, Pose())
        return _Merged(moving, carried, places)

    def _body(self, joint: Joint, carrier: str | None, pose: Pose, inertial: Inertial) -> Body:
        com, inertia = inertial.about_com()
        return Body(joint.name, carrier, pose.rotation, pose.origin, joint.axis, inertial.mass,
                    com, inertia, joint.kind, joint.lower, joint.upper, joint.child)
