"""Reader of URDF: the tree of links and joints of a robot description, without meshes."""

import functools
import math
from collections.abc import Mapping, Sequence
from os import PathLike
from xml.etree.ElementTree import Element

import numpy as np

from clie_blocks.errors import ClieError, nearest
from clie_blocks.rigid_body.description import (
    FIXED,
    Description,
    Inertial,
    Joint,
    Pose,
)
from clie_blocks.rigid_body.rotations import turn_about
from clie_blocks.rigid_body.tree import GRAVITY, PRISMATIC, REVOLUTE, Tree, tree
from clie_blocks.rigid_body.xml_file import attribute_numbers, read_root

_KINDS = {"revolute": REVOLUTE, "continuous": REVOLUTE, "prismatic": PRISMATIC, "fixed": FIXED}
_OTHER = {"floating": "a base that moves freely", "planar": "a joint of three axes"}


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
        Links between which the joints are kept: those that lead to the tip move, all others are
        held at zero; by default all joints behind the base move.
    locked : mapping of str to float, optional
        Joints that are held, and where [rad or m].
    gravity : sequence of float
        In the frame of the base [m/s^2].

    Raises
    ------
    ClieError
        If the file is no URDF, is not expanded (xacro), couples joints that move (mimic), has a
        link that could not exist, or does not name what is asked for.

    """
    return tree(describe_urdf(path).bodies(base, tip, locked), gravity)


def describe_urdf(path: str | PathLike[str]) -> Description:
    """Read what a URDF file says of links and joints.

    Raises
    ------
    ClieError
        If the file is no URDF, or a number in it is none.

    """
    robot, source = read_root(path, "URDF"), str(path)
    if robot.tag != "robot":
        raise ClieError(f"{source} begins with <{robot.tag}>, not with <robot>; a URDF is needed")
    numbers = functools.partial(_Numbers, source)
    return Description(
        source, {_name(link, source): _inertial(link, numbers(f"link {_name(link, source)!r}"))
                 for link in robot.iterfind("link")},
        tuple(_joint(joint, source, numbers(f"joint {_name(joint, source)!r}"))
              for joint in robot.iterfind("joint")))


class _Numbers:
    """Numbers of the attributes of one link or joint."""

    def __init__(self, source: str, what: str) -> None:
        self.source, self.what = source, what

    def __call__(self, element: Element | None, key: str, count: int, default: str) -> np.ndarray:
        return attribute_numbers(element, key, (count,), default, self.what, self.source)

    def one(self, element: Element | None, key: str) -> float:
        """One number; 0 where it is not stated."""
        return float(self(element, key, 1, "0")[0])


def _name(element: Element, source: str) -> str:
    name = element.get("name")
    if not name:
        raise ClieError(f"{source}: a <{element.tag}> has no name; give it one")
    return name


def _pose(element: Element, numbers: _Numbers) -> Pose:
    origin = element.find("origin")
    roll, pitch, yaw = numbers(origin, "rpy", 3, "0 0 0")
    x, y, z = np.eye(3)
    return Pose(turn_about(z, yaw) @ turn_about(y, pitch) @ turn_about(x, roll),
                numbers(origin, "xyz", 3, "0 0 0"))


def _inertial(link: Element, numbers: _Numbers) -> Inertial:
    """Inertial of a link in the frame of the link; nothing where it has none."""
    inertial = link.find("inertial")
    if inertial is None:
        return Inertial()
    tensor = inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (numbers.one(tensor, key)
                              for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    own = Inertial(numbers.one(inertial.find("mass"), "value"), inertia=about_com)
    return own.seen_from(_pose(inertial, numbers))


def _joint(joint: Element, source: str, numbers: _Numbers) -> Joint:
    kind = joint.get("type", "")
    if kind not in _KINDS:
        reason = _OTHER.get(kind) or f"no kind of joint; {nearest(kind, list(_KINDS))}"
        raise ClieError(f"{source}: {numbers.what} is {kind!r}: {reason}")
    parent, child = (_end(joint, end, numbers) for end in ("parent", "child"))
    lower, upper = _limits(joint, kind, numbers)
    mimic = joint.find("mimic")
    obstacle = "" if mimic is None else (
        f"follows {mimic.get('joint')!r} (<mimic>), which is a loop; lock it where it stands, or "
        "give it a drive of its own")
    return Joint(_name(joint, source), _KINDS[kind], parent, child, _pose(joint, numbers),
                 numbers(joint.find("axis"), "xyz", 3, "1 0 0"), lower, upper, obstacle,
                 numbers.one(joint.find("dynamics"), "damping"),
                 numbers.one(joint.find("dynamics"), "friction"),
                 numbers.one(joint.find("limit"), "effort") or math.inf)


def _end(joint: Element, end: str, numbers: _Numbers) -> str:
    element = joint.find(end)
    link = None if element is None else element.get("link")
    if not link:
        raise ClieError(f"{numbers.source}: {numbers.what} has no <{end} link=...>; name the link")
    return link


def _limits(joint: Element, kind: str, numbers: _Numbers) -> tuple[float, float]:
    limit = joint.find("limit")
    if limit is None or kind == "continuous":
        return -math.inf, math.inf
    lower, upper = numbers.one(limit, "lower"), numbers.one(limit, "upper")
    return (lower, upper) if lower < upper else (-math.inf, math.inf)
