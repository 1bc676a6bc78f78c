"""Reader of MJCF, MuJoCo's own format: the tree of bodies and joints, without meshes."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Self
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
from clie_blocks.rigid_body.rotations import of_quaternion, rotation_from_z, turn_about, unit
from clie_blocks.rigid_body.solids import SOLIDS, solid
from clie_blocks.rigid_body.tree import PRISMATIC, REVOLUTE, Tree, tree
from clie_blocks.rigid_body.xml_file import attribute_numbers, read_root

WORLD, _MAIN = "world", "main"
_KINDS = {"hinge": REVOLUTE, "slide": PRISMATIC}
_OTHER = {"free": "a base that moves freely; name the link that stands still: base = ...",
          "ball": "a joint of three axes, which no single motor drives; lock it"}
_REMEDY = "write it out with MuJoCo, mujoco.mj_saveLastXML, and name the new file"
_DENSITY = "1000"  # kg/m^3, of geoms whose file states none
_NOT_EXPANDED = "include", "replicate", "attach", "composite", "flexcomp"


def read_mjcf(path: str | PathLike[str], base: str | None = None, tip: str | None = None,
              locked: Mapping[str, float] | None = None,
              gravity: Sequence[float] | None = None) -> Tree:
    """Read the bodies and joints of an MJCF file.

    Parameters
    ----------
    path : path-like
        The file.
    base, tip : str, optional
        Bodies between which the joints are kept: those that lead to the tip move, all others are
        held at zero; by default all joints behind the base move.
    locked : mapping of str to float, optional
        Joints that are held, and where [rad or m].
    gravity : sequence of float, optional
        In the frame of the base [m/s^2]; by default that of the file.

    Raises
    ------
    ClieError
        If the file is no MJCF, must be expanded first (include, replicate, attach), couples joints
        that move (equality), has a body whose mass lies in a mesh or that could not exist, or does
        not name what is asked for.

    """
    stated = gravity_of_mjcf(path) if gravity is None else gravity
    return tree(describe_mjcf(path).bodies(base, tip, locked), stated)


def gravity_of_mjcf(path: str | PathLike[str]) -> np.ndarray:
    """Read the gravity of an MJCF file (3,) [m/s^2]."""
    root = read_root(path, "MJCF")
    option = root.find("option")
    return _Model.of_root(root, str(path)).numbers(option, "gravity", "0 0 -9.81", "the option", 3)


def describe_mjcf(path: str | PathLike[str]) -> Description:
    """Read what an MJCF file says of bodies and joints.

    Raises
    ------
    ClieError
        If the file is no MJCF, must be expanded first, or a number in it is none.

    """
    return _Model.of_root(read_root(path, "MJCF"), str(path)).describe()


@dataclasses.dataclass(frozen=True, eq=False)
class _Defaults:
    """Default attributes of joints and geoms, by class and element."""

    by_class: dict[str, dict[str, dict[str, str]]]

    @classmethod
    def of_root(cls, root: Element) -> Self:
        by_class: dict[str, dict[str, dict[str, str]]] = {}

        def add(default: Element, inherited: dict[str, dict[str, str]], name: str) -> None:
            own = {tag: dict(attributes) for tag, attributes in inherited.items()}
            for element in default:
                if element.tag != "default":
                    own.setdefault(element.tag, {}).update(element.attrib)
            by_class[name] = own
            for inner in default.iterfind("default"):
                add(inner, own, inner.get("class", ""))

        for default in root.iterfind("default"):
            add(default, by_class.get(_MAIN, {}), _MAIN)
            by_class[default.get("class", _MAIN)] = by_class[_MAIN]
        return cls(by_class)

    def complete(self, element: Element, childclass: str, source: str) -> Element:
        """Element with the attributes that its class gives it."""
        name = element.get("class") or childclass or _MAIN
        if name not in self.by_class and name != _MAIN:
            raise ClieError(f"{source}: a <{element.tag}> is of class {name!r}, which no "
                            f"<default> has; {nearest(name, list(self.by_class))}")
        given = self.by_class.get(name, {}).get(element.tag, {})
        whole = Element(element.tag, {**given, **element.attrib})
        whole.extend(element)
        return whole


@dataclasses.dataclass(frozen=True, eq=False)
class _Model:
    """A file, and the conventions that it states."""

    root: Element
    source: str
    defaults: _Defaults
    degrees: bool
    order: str
    from_geoms: str
    groups: tuple[float, float]

    @classmethod
    def of_root(cls, root: Element, source: str) -> Self:
        if root.tag != "mujoco":
            raise ClieError(f"{source} begins with <{root.tag}>, not with <mujoco>; an MJCF is "
                            "needed")
        for tag in _NOT_EXPANDED:
            found = root.find(f".//{tag}")
            if found is not None:
                name = found.get("file")
                raise ClieError(f"{source} has <{tag}{f' file={name!r}' if name else ''}>, which "
                                f"is not expanded here; {_REMEDY}")
        compiler = Element("compiler")
        for element in root.iterfind("compiler"):
            compiler.attrib.update(element.attrib)
        for key in ("settotalmass", "boundmass", "boundinertia"):
            if float(compiler.get(key, "0")) > 0.0:
                raise ClieError(f"{source}: the compiler changes masses ({key}); {_REMEDY}")
        groups = attribute_numbers(compiler, "inertiagrouprange", (2,), "0 5", "the compiler",
                                   source)
        return cls(root, source, _Defaults.of_root(root),
                   compiler.get("angle", "degree") == "degree",
                   compiler.get("eulerseq", "xyz"), compiler.get("inertiafromgeom", "auto"),
                   (groups[0], groups[1]))

    def numbers(self, element: Element | None, key: str, default: str, what: str,
                *counts: int) -> np.ndarray:
        """Numbers of an attribute, as many as one of some counts."""
        return attribute_numbers(element, key, counts, default, what, self.source)

    def describe(self) -> Description:
        """Links and joints; every body is a link, and one more stands between two joints."""
        world = self.root.find("worldbody")
        if world is None:
            raise ClieError(f"{self.source} has no <worldbody>, so that it holds no robot")
        links: dict[str, Inertial] = {WORLD: Inertial()}
        joints: list[Joint] = []
        self._add_bodies(world, WORLD, Pose(), "", links, joints)
        coupled, gears = self._coupled_joints(), self._gears()
        return Description(self.source, links, tuple(
            dataclasses.replace(joint, gear=gears.get(joint.name, 1.0),
                                obstacle=joint.obstacle or coupled.get(joint.name, ""))
            for joint in joints))

    def _gears(self) -> dict[str, float]:
        """Gear of each joint that one motor of the file drives, as a torque per command."""
        gears = {}
        for element in self.root.iterfind("actuator/motor"):
            motor = self.defaults.complete(element, "", self.source)
            joint = motor.get("joint", "")
            what = f"the motor of joint {joint!r}"
            gears[joint] = float(self.numbers(motor, "gear", "1", what, *range(1, 7))[0])
        return gears

    def _coupled_joints(self) -> dict[str, str]:
        """Why joints that an equality couples cannot move in a tree."""
        coupled = {}
        for equality in self.root.iterfind("equality"):
            for element in equality:
                if element.get("active", "true") == "false":
                    continue
                if element.tag == "joint" and element.get("joint2"):
                    coupled[element.get("joint1", "")] = (
                        f"follows {element.get('joint2')!r} (<equality>), which is a loop; lock "
                        "it where it stands, or give it a drive of its own")
                elif element.tag in ("connect", "weld"):
                    raise ClieError(f"{self.source}: bodies {element.get('body1')!r} and "
                                    f"{element.get('body2')!r} are joined by <{element.tag}>, "
                                    "which closes a loop; a tree has none")
        return coupled

    def _add_bodies(self, parent: Element, link: str, frame: Pose, childclass: str,
                    links: dict[str, Inertial], joints: list[Joint]) -> None:
        """Add the bodies inside a body or frame, whose own frame has a pose in that of a link."""
        for element in parent:
            inner = element.get("childclass") or childclass
            if element.tag == "frame":
                pose = frame.then(self._pose(element, "a frame"))
                self._add_bodies(element, link, pose, inner, links, joints)
            elif element.tag == "body":
                name = element.get("name") or f"body {len(links)}"
                if name in links:
                    raise ClieError(f"{self.source}: two bodies are called {name!r}; rename one")
                pose = frame.then(self._pose(element, f"body {name!r}"))
                offset = self._add_joints(element, name, link, pose, inner, links, joints)
                links[name] = self._inertial(element, name, inner).seen_from(offset)
                self._add_bodies(element, name, offset, inner, links, joints)

    def _add_joints(self, body: Element, name: str, parent: str, pose: Pose, childclass: str,
                    links: dict[str, Inertial], joints: list[Joint]) -> Pose:
        """Add the joints of a body, and return its frame's pose in the frame of the last joint."""
        what = f"body {name!r}"
        if body.find("freejoint") is not None:
            joints.append(Joint(name, REVOLUTE, parent, name, pose, np.eye(3)[2],
                                obstacle=f"is {_OTHER['free']}"))
            return Pose()
        own = [self.defaults.complete(joint, childclass, self.source)
               for joint in self._joints_of(body)]
        if not own:
            joints.append(Joint(f"weld of {name}", FIXED, parent, name, pose, np.eye(3)[2]))
            return Pose()
        offset = Pose()
        for i, joint in enumerate(own):
            called = joint.get("name") or (name if len(own) == 1 else f"{name} {i + 1}")
            anchor = self.numbers(joint, "pos", "0 0 0", what, 3)
            axis = self.numbers(joint, "axis", "0 0 1", what, 3)
            child = name if i == len(own) - 1 else f"{name} behind {called}"
            joints.append(self._joint(joint, called, parent, child,
                                      pose.then(Pose(origin=anchor)), axis))
            offset, pose, parent = Pose(origin=-anchor), Pose(origin=-anchor), child
            if i < len(own) - 1:
                links[child] = Inertial()
        return offset

    def _joint(self, joint: Element, name: str, parent: str, child: str, pose: Pose,
               axis: np.ndarray) -> Joint:
        """A joint whose frame at its reference has a pose; the file counts from there."""
        kind, what = joint.get("type", "hinge"), f"joint {name!r}"
        if kind in _OTHER:
            return Joint(name, REVOLUTE, parent, child, pose, np.eye(3)[2],
                         obstacle=f"is {_OTHER[kind]}")
        if kind not in _KINDS:
            raise ClieError(f"{self.source}: {what} is {kind!r}, no kind of joint; "
                            f"{nearest(kind, [*_KINDS, *_OTHER])}")
        turns = kind == "hinge"
        scale = math.radians(1.0) if self.degrees and turns else 1.0
        reference = scale * self.numbers(joint, "ref", "0", what, 1)[0]
        lower, upper = scale * self.numbers(joint, "range", "0 0", what, 2)
        limited = joint.get("limited", "auto")
        if limited == "false" or (limited == "auto" and not lower < upper):
            lower, upper = -math.inf, math.inf
        damping, dry_friction, armature = (
            float(self.numbers(joint, key, "0", what, 1)[0])
            for key in ("damping", "frictionloss", "armature"))
        at_reference = Joint(name, _KINDS[kind], parent, child, pose, axis, lower, upper,
                             damping=damping, dry_friction=dry_friction, armature=armature)
        return dataclasses.replace(at_reference, pose=at_reference.at(-reference))

    def _pose(self, element: Element, what: str) -> Pose:
        """Pose that an element states, in one of five ways."""
        origin = self.numbers(element, "pos", "0 0 0", what, 3)
        named = f"{self.source}: an axis of {what}"
        scale = math.radians(1.0) if self.degrees else 1.0
        if element.get("quat"):
            return Pose(of_quaternion(self.numbers(element, "quat", "", what, 4), named), origin)
        if element.get("axisangle"):
            x, y, z, angle = self.numbers(element, "axisangle", "", what, 4)
            return Pose(turn_about(unit(np.array([x, y, z]), named), scale * angle), origin)
        if element.get("euler"):
            angles = scale * self.numbers(element, "euler", "", what, 3)
            return Pose(self._of_euler(angles), origin)
        if element.get("xyaxes"):
            x, y = self.numbers(element, "xyaxes", "", what, 6).reshape(2, 3)
            x = unit(x, named)
            y = unit(y - x * (x @ y), named)
            return Pose(np.stack([x, y, np.cross(x, y)], axis=1), origin)
        if element.get("zaxis"):
            z = self.numbers(element, "zaxis", "", what, 3)
            return Pose(rotation_from_z(z, named), origin)
        return Pose(origin=origin)

    def _of_euler(self, angles: np.ndarray) -> np.ndarray:
        """Rotation of three angles: letters turn about moving axes, capitals about fixed ones."""
        turn = np.eye(3)
        for letter, angle in zip(self.order, angles):
            step = turn_about(np.eye(3)["xyz".index(letter.lower())], angle)
            turn = turn @ step if letter.islower() else step @ turn
        return turn

    def _inertial(self, body: Element, name: str, childclass: str) -> Inertial:
        """Inertial of a body in its own frame, as stated or from its geoms."""
        stated, what = body.find("inertial"), f"the inertial of body {name!r}"
        if stated is None or self.from_geoms == "true":
            return self._of_geoms(body, name, childclass) if self.from_geoms != "false" else (
                Inertial())
        mass = self.numbers(stated, "mass", "", what, 1)[0]
        if stated.get("fullinertia"):
            xx, yy, zz, xy, xz, yz = self.numbers(stated, "fullinertia", "", what, 6)
            about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            about_com = np.diag(self.numbers(stated, "diaginertia", "", what, 3))
        return Inertial(mass, inertia=about_com).seen_from(self._pose(stated, what))

    def _of_geoms(self, body: Element, name: str, childclass: str) -> Inertial:
        whole = Inertial()
        for geom, frame in self._geoms(body, Pose(), childclass):
            what, kind = f"a geom of body {name!r}", geom.get("type", "sphere")
            group = self.numbers(geom, "group", "0", what, 1)[0]
            if not self.groups[0] <= group <= self.groups[1]:
                continue
            stated = geom.get("mass")
            mass = None if stated is None else self.numbers(geom, "mass", "", what, 1)[0]
            density = self.numbers(geom, "density", _DENSITY, what, 1)[0]
            if mass == 0.0 or (mass is None and density == 0.0) or kind == "plane":
                continue
            if kind not in SOLIDS or geom.get("mesh"):
                raise ClieError(
                    f"{self.source}: the mass of body {name!r} lies in a {kind}, which is not "
                    f"read; give the body an <inertial>: {_REMEDY}")
            size = self.numbers(geom, "size", "", what, 1, 2, 3)
            pose = frame.then(self._pose(geom, what))
            if geom.get("fromto"):
                ends = self.numbers(geom, "fromto", "", what, 6).reshape(2, 3)
                along = ends[0] - ends[1]
                pose = frame.then(Pose(rotation_from_z(along, f"{self.source}: fromto of {what}"),
                                       ends.mean(axis=0)))
                half = np.linalg.norm(along) / 2
                size = np.array([size[0], half] if SOLIDS[kind] == 2 else [size[0], size[0], half])
            whole = whole + self._solid(kind, size, mass, density, what).seen_from(pose)
        return whole

    def _solid(self, kind: str, size: np.ndarray, mass: float | None, density: float, what: str,
               ) -> Inertial:
        count = SOLIDS[kind]
        if len(size) < count or not (size[:count] > 0.0).all():
            raise ClieError(f"{self.source}: size of {what}, a {kind}, must be {count} positive "
                            f"number{'s' if count > 1 else ''} [m]")
        volume, per_mass = solid(kind, size)
        mass = density * volume if mass is None else mass
        return Inertial(mass, inertia=mass * np.diag(per_mass))

    def _geoms(self, parent: Element, frame: Pose, childclass: str,
               ) -> Iterator[tuple[Element, Pose]]:
        """Geoms of a body, with the pose of the frame that they are stated in."""
        for element in parent:
            if element.tag == "geom":
                yield self.defaults.complete(element, childclass, self.source), frame
            elif element.tag == "frame":
                inner = frame.then(self._pose(element, "a frame"))
                yield from self._geoms(element, inner, element.get("childclass") or childclass)

    def _joints_of(self, body: Element) -> list[Element]:
        for frame in _frames(body):
            if frame.find("joint") is not None:
                raise ClieError(f"{self.source}: a <joint> stands in a <frame>, which is not "
                                f"expanded here; {_REMEDY}")
        return body.findall("joint")


def _frames(body: Element) -> Iterator[Element]:
    """Frames of a body, and those inside them."""
    for frame in body.iterfind("frame"):
        yield frame
        yield from _frames(frame)
