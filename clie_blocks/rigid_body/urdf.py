"""Reader of URDF: the tree of links and joints of a robot description, without meshes."""

import dataclasses
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from clie_blocks.errors import ClieError, nearest
from clie_blocks.rigid_body.tree import GRAVITY, PRISMATIC, REVOLUTE, Body, Tree, steiner, tree

LARGEST_FILE = 20_000_000  # bytes
_MOVING = {"revolute": REVOLUTE, "continuous": REVOLUTE, "prismatic": PRISMATIC}
_OTHER = {"floating": "a base that moves freely", "planar": "a joint of three axes",
          "ball": "a joint of three axes"}


@dataclasses.dataclass(frozen=True, eq=False)
class _Pose:
    """Frame in another one: rotation (3, 3) and origin (3,) [m]."""

    rotation: np.ndarray
    origin: np.ndarray

    def then(self, other: "_Pose") -> "_Pose":
        return _Pose(self.rotation @ other.rotation,
                     self.origin + self.rotation @ other.origin)


@dataclasses.dataclass(frozen=True, eq=False)
class _Inertial:
    """Mass [kg], first moment (3,) [kg m] and inertia (3, 3) about the origin [kg m^2]."""

    mass: float
    moment: np.ndarray
    inertia: np.ndarray

    def __add__(self, other: "_Inertial") -> "_Inertial":
        return _Inertial(self.mass + other.mass, self.moment + other.moment,
                         self.inertia + other.inertia)

    def seen_from(self, pose: _Pose) -> "_Inertial":
        """The same link in the frame in which its own frame has a pose."""
        com = self.moment / self.mass if self.mass else np.zeros(3)
        about_com = self.inertia - self.mass * steiner(com)
        there = pose.origin + pose.rotation @ com
        return _Inertial(self.mass, self.mass * there,
                         pose.rotation @ about_com @ pose.rotation.T + self.mass * steiner(there))

    def as_com(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass [m] and inertia about it."""
        com = self.moment / self.mass if self.mass else np.zeros(3)
        return com, self.inertia - self.mass * steiner(com)


_NOTHING = _Inertial(0.0, np.zeros(3), np.zeros((3, 3)))


@dataclasses.dataclass(frozen=True, eq=False)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    pose: _Pose
    axis: np.ndarray
    lower: float
    upper: float


def read_urdf(path: str | PathLike[str], base: str | None = None, tip: str | None = None,
              locked: Mapping[str, float] | None = None,
              gravity: Sequence[float] = GRAVITY) -> Tree:
    """Read the links and joints of a URDF file.

    Fixed joints are merged into the links that carry them, and so are locked ones.

    Parameters
    ----------
    path : path-like
        The file.
    base, tip : str, optional
        Links between which the joints are kept: the joints that lead to the tip, with all that
        they carry, or all joints behind the base.
    locked : mapping of str to float, optional
        Joints that are held, and where [rad or m].
    gravity : sequence of float
        In the frame of the base [m/s^2].

    Raises
    ------
    ClieError
        If the file is no URDF, is not expanded (xacro), couples joints (mimic), has a link that
        could not exist, or does not name what is asked for.

    """
    place = Path(path)
    robot = _root(place)
    links = {_name(link, place): _inertial(link, place) for link in robot.iterfind("link")}
    joints = [_joint(joint, place) for joint in robot.iterfind("joint")]
    _check_links(joints, links, place)
    held = dict(locked or {})
    for name in held:
        if name not in [joint.name for joint in joints]:
            raise ClieError(f"{place}: there is no joint {name!r} to lock; "
                            f"{nearest(name, [joint.name for joint in joints])}")
    root = _base_of(joints, links, base, place)
    kept = None if tip is None else _joints_between(joints, links, root, tip, place)
    return tree(_bodies(joints, links, root, held, kept), gravity)


def _root(place: Path) -> ElementTree.Element:
    """The robot of a file, of which no part comes from elsewhere."""
    if not place.is_file():
        raise ClieError(f"{place} is no file; name the URDF of the robot")
    if place.stat().st_size > LARGEST_FILE:
        raise ClieError(f"{place} has {place.stat().st_size / 1e6:.0f} MB; a robot description "
                        "has less than 20 MB, without its meshes")
    text = place.read_text(encoding="utf-8", errors="replace")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ClieError(f"{place} defines entities, which are not expanded here; remove the "
                        "<!DOCTYPE ...> from it")
    if "xacro:" in text:
        raise ClieError(f"{place} is not expanded; run: xacro {place} > robot.urdf")
    try:
        robot = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ClieError(f"{place} is no XML: {error}") from None
    if robot.tag != "robot":
        raise ClieError(f"{place} begins with <{robot.tag}>, not with <robot>; a URDF is needed")
    return robot


def _name(element: ElementTree.Element, place: Path) -> str:
    name = element.get("name")
    if not name:
        raise ClieError(f"{place}: a <{element.tag}> has no name; give it one")
    return name


def _numbers(element: ElementTree.Element | None, key: str, count: int, default: str,
             what: str, place: Path) -> np.ndarray:
    """Some numbers of an attribute."""
    text = default if element is None else element.get(key, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.full(0, np.nan)
    if values.size != count or not np.isfinite(values).all():
        raise ClieError(f"{place}: {key}={text!r} of {what} must be {count} finite number"
                        f"{'s' if count > 1 else ''}")
    return values


def _pose(element: ElementTree.Element, what: str, place: Path) -> _Pose:
    origin = element.find("origin")
    roll, pitch, yaw = _numbers(origin, "rpy", 3, "0 0 0", what, place)
    return _Pose(_turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll),
                 _numbers(origin, "xyz", 3, "0 0 0", what, place))


def _turn(axis: int, angle: float) -> np.ndarray:
    """Rotation about a coordinate axis."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i] = turn[j, j] = cosine
    turn[i, j], turn[j, i] = -sine, sine
    return turn


def _inertial(link: ElementTree.Element, place: Path) -> _Inertial:
    """Inertial of a link in the frame of the link; nothing where it has none."""
    inertial = link.find("inertial")
    if inertial is None:
        return _NOTHING
    what = f"link {_name(link, place)!r}"
    (mass,) = _numbers(inertial.find("mass"), "value", 1, "0", what, place)
    tensor = inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (_numbers(tensor, key, 1, "0", what, place)[0]
                              for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return _Inertial(mass, np.zeros(3), own).seen_from(_pose(inertial, what, place))


def _joint(joint: ElementTree.Element, place: Path) -> _Joint:
    name = _name(joint, place)
    kind, what = joint.get("type", ""), f"joint {name!r}"
    if joint.find("mimic") is not None:
        raise ClieError(f"{place}: {what} follows another joint (<mimic>), which is a loop; lock "
                        "it where it stands, or give it a drive of its own")
    if kind not in (*_MOVING, "fixed"):
        reason = _OTHER.get(kind, f"no kind of joint that is known; "
                                  f"{nearest(kind, (*_MOVING, 'fixed'))}")
        raise ClieError(f"{place}: {what} is {kind!r}: {reason}")
    ends = []
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is None or not element.get("link"):
            raise ClieError(f"{place}: {what} has no <{end} link=...>")
        ends.append(element.get("link", ""))
    lower, upper = _limits(joint, kind, what, place)
    return _Joint(name, kind, *ends, _pose(joint, what, place),
                  _numbers(joint.find("axis"), "xyz", 3, "1 0 0", what, place), lower, upper)


def _limits(joint: ElementTree.Element, kind: str, what: str, place: Path) -> tuple[float, float]:
    limit = joint.find("limit")
    if limit is None or kind == "continuous":
        return -math.inf, math.inf
    lower, upper = (_numbers(limit, key, 1, "0", what, place)[0] for key in ("lower", "upper"))
    return (lower, upper) if lower < upper else (-math.inf, math.inf)


def _check_links(joints: Sequence[_Joint], links: Mapping[str, _Inertial], place: Path) -> None:
    """Each joint between two links that are there, and no link carried twice."""
    carried: dict[str, str] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise ClieError(f"{place}: joint {joint.name!r} names link {link!r}, which is not "
                                f"there; {nearest(link, list(links))}")
        if joint.child in carried:
            raise ClieError(f"{place}: link {joint.child!r} is carried by joints "
                            f"{carried[joint.child]!r} and {joint.name!r}; a tree has no loop")
        carried[joint.child] = joint.name


def _base_of(joints: Sequence[_Joint], links: Mapping[str, _Inertial], base: str | None,
             place: Path) -> str:
    """The link that stands still: the one that is asked for, or the one that nothing carries."""
    if base is not None:
        if base not in links:
            raise ClieError(f"{place}: there is no link {base!r}; {nearest(base, list(links))}")
        return base
    roots = [link for link in links if link not in {joint.child for joint in joints}]
    if len(roots) != 1:
        names = ", ".join(map(repr, roots)) or "none"
        raise ClieError(f"{place}: a robot has one base, this file has {len(roots)} ({names}); "
                        "name the one that stands still: base = ...")
    return roots[0]


def _joints_between(joints: Sequence[_Joint], links: Mapping[str, _Inertial], base: str, tip: str,
                    place: Path) -> set[str]:
    """Joints on the way from the base to a tip."""
    if tip not in links:
        raise ClieError(f"{place}: there is no link {tip!r}; {nearest(tip, list(links))}")
    carrying = {joint.child: joint for joint in joints}
    names, link = set(), tip
    while link != base:
        if link not in carrying:
            raise ClieError(f"{place}: link {tip!r} is not carried by {base!r}; choose a base on "
                            "its way to the root")
        names.add(carrying[link].name)
        link = carrying[link].parent
    return names


def _bodies(joints: Sequence[_Joint], links: Mapping[str, _Inertial], base: str,
            locked: Mapping[str, float], kept: set[str] | None) -> list[Body]:
    """Joints that move, each with all that it carries rigidly.

    A joint off the way to the tip is held at zero.
    """
    behind: dict[str, list[_Joint]] = {}
    for joint in joints:
        behind.setdefault(joint.parent, []).append(joint)
    moving: dict[str, tuple[_Joint, str | None, _Pose]] = {}
    carried: dict[str | None, _Inertial] = {None: _NOTHING}
    waiting: list[tuple[str, str | None, _Pose]] = [(base, None, _Pose(np.eye(3), np.zeros(3)))]
    while waiting:
        link, carrier, pose = waiting.pop(0)
        carried[carrier] = carried[carrier] + links[link].seen_from(pose)
        for joint in behind.get(link, []):
            there = pose.then(joint.pose)
            moves = (joint.kind in _MOVING and joint.name not in locked
                     and (kept is None or joint.name in kept))
            if moves:
                moving[joint.name] = joint, carrier, there
                carried[joint.name] = _NOTHING
                waiting.append((joint.child, joint.name, _Pose(np.eye(3), np.zeros(3))))
            else:
                waiting.append((joint.child, carrier, _held(joint, there, locked)))
    bodies = []
    for name, (joint, carrier, pose) in moving.items():
        com, inertia = carried[name].as_com()
        bodies.append(Body(name, carrier, pose.rotation, pose.origin, joint.axis,
                           carried[name].mass, com, inertia, _MOVING[joint.kind], joint.lower,
                           joint.upper, joint.child))
    return bodies


def _held(joint: _Joint, pose: _Pose, locked: Mapping[str, float]) -> _Pose:
    """Frame behind a joint that is held where it is locked, or at zero."""
    where = locked.get(joint.name, 0.0)
    if joint.kind == "fixed" or not where:
        return pose
    axis = joint.axis / np.linalg.norm(joint.axis)
    if _MOVING[joint.kind] == PRISMATIC:
        return pose.then(_Pose(np.eye(3), where * axis))
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(where) * across + (1.0 - math.cos(where)) * across @ across
    return pose.then(_Pose(turn, np.zeros(3)))
