"""A tree from a URDF or MJCF file, with joints that count as the logs of the robot do."""

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError, nearest
from clie_blocks.rigid_body.description import Description
from clie_blocks.rigid_body.mjcf import describe_mjcf, gravity_of_mjcf
from clie_blocks.rigid_body.rotations import turn_about, unit
from clie_blocks.rigid_body.tree import GRAVITY, PRISMATIC, Body, Tree, steiner, tree
from clie_blocks.rigid_body.urdf import describe_urdf

_ROUNDED_ANGLE = 1e-5  # rad: half a step of the fourth decimal of 1.5708
MODEL_FILES = {".urdf": "URDF", ".xml": "MJCF", ".mjcf": "MJCF"}


def read_model(path: str | PathLike[str], base: str | None = None, tip: str | None = None,
               locked: Mapping[str, float] | None = None, *, joints: Sequence[str] = (),
               sign: ArrayLike | None = None, zero: ArrayLike | None = None,
               gravity: ArrayLike | None = None, payload: float = 0.0) -> Tree:
    """Read links and joints from a URDF or MJCF file, positions as a robot's logs count them.

    Parameters
    ----------
    path : path-like
        The file, ``.urdf``, ``.xml`` or ``.mjcf``.
    base, tip, locked
        See `read_urdf`; the tip is where a load sits, too.
    joints : sequence of str
        Joints in the order of the logs; by default all that move, from the base outwards.
    sign, zero : array_like, shape (n,), optional
        Position in the model is the logged one times its sign (1 or -1), and its zero [rad or m]
        more; by default 1 and 0.
    gravity : array_like, shape (3,), optional
        In the frame of the base [m/s^2]; by default that of the file, down its z axis in URDF.
    payload : float
        Mass that the robot always carries at the tip [kg].

    Raises
    ------
    ClieError
        If the file cannot be read, or its joints are not those that are listed.

    """
    description, of_file = _describe(path)
    bodies = _listed(description.bodies(base, tip, locked), joints, description.source)
    _check_order(bodies, description.source)
    n = len(bodies)
    signs = np.ones(n) if sign is None else np.asarray(sign, float)
    zeros = np.zeros(n) if zero is None else np.asarray(zero, float)
    for what, values in (("sign", signs), ("zero", zeros)):
        if values.shape != (n,):
            raise ClieError(f"{description.source}: {n} joints move, and {what} has "
                            f"{values.size} entries; list one per joint of the model")
    bodies = [_counted(_squared(body), *of_joint)
              for body, *of_joint in zip(bodies, signs, zeros, strict=True)]
    carrier: str | None = bodies[-1].name
    place = bodies[-1].com
    if tip is not None:
        carrier, place = description.point(tip, base, tip, locked)
    if carrier != bodies[-1].name:
        raise ClieError(f"{description.source}: {tip!r} is moved by joint {carrier!r}, not by the "
                        f"last one, {bodies[-1].name!r}; list the joints from the base to the tip")
    bodies[-1] = _loaded(bodies[-1], payload, np.asarray(place))
    return tree(bodies, of_file if gravity is None else gravity, place)


def joint_names(path: str | PathLike[str]) -> tuple[str, ...]:
    """Names of all joints in a URDF or MJCF file, those that are fixed, too."""
    return tuple(joint.name for joint in describe(path).joints)


def describe(path: str | PathLike[str]) -> Description:
    """Read what a URDF or MJCF file says of links and joints, before they are a tree."""
    return _describe(path)[0]


def _describe(path: str | PathLike[str]) -> tuple[Description, ArrayLike]:
    """What a file says, and its gravity."""
    kind = MODEL_FILES.get(Path(path).suffix.lower())
    if kind is None:
        raise ClieError(f"{path}: a robot description ends in {', '.join(MODEL_FILES)}; "
                        "expand a xacro file first: xacro robot.xacro > robot.urdf")
    if kind == "URDF":
        return describe_urdf(path), GRAVITY
    return describe_mjcf(path), gravity_of_mjcf(path)


def _listed(bodies: Sequence[Body], joints: Sequence[str], source: str) -> list[Body]:
    """Bodies in the order of the joints of a log."""
    if not joints:
        return list(bodies)
    by_name = {body.name: body for body in bodies}
    for name in joints:
        if name not in by_name:
            raise ClieError(f"{source}: there is no joint {name!r} that moves; "
                            f"{nearest(name, list(by_name))}")
    for name in by_name:
        if name not in joints:
            held = f'{{ "{name}" = 0.0 }}'
            raise ClieError(
                f"{source}: joint {name!r} moves, and no log holds it (they hold "
                f"{', '.join(joints)}); lock it where it stands, locked = {held}, "
                "or name the tip of the arm")
    return [by_name[name] for name in joints]


def _check_order(bodies: Sequence[Body], source: str) -> None:
    """Refuse joints that are listed before the joint that carries them."""
    names = [body.name for body in bodies]
    for k, body in enumerate(bodies):
        if body.parent is not None and body.parent not in names[:k]:
            raise ClieError(f"{source}: joint {body.name!r} is listed before {body.parent!r}, "
                            "which carries it; list the joints from the base outwards")


def _squared(body: Body) -> Body:
    """Body that stands at a right angle to its parent where the file rounds one to 1.5708."""
    whole = np.round(body.rotation)
    rounded = np.abs(body.rotation - whole).max() < _ROUNDED_ANGLE
    return dataclasses.replace(body, rotation=whole) if rounded else body


def _counted(body: Body, sign: float, zero: float) -> Body:
    """Body whose joint counts with a sign and from a zero of its own."""
    if abs(sign) != 1.0:
        raise ClieError(f"the sign of joint {body.name!r} is {sign:g}; it must be 1 or -1")
    axis = unit(np.asarray(body.axis, float), f"the axis of joint {body.name!r}")
    lower, upper = sorted((sign * (body.lower - zero), sign * (body.upper - zero)))
    counted = dataclasses.replace(body, axis=sign * axis, lower=lower, upper=upper)
    if body.kind == PRISMATIC:
        return dataclasses.replace(counted, offset=body.offset + body.rotation @ (zero * axis))
    return dataclasses.replace(counted, rotation=body.rotation @ turn_about(axis, zero))


def _loaded(body: Body, mass: float, place: np.ndarray) -> Body:
    """Body with a point mass that it carries."""
    if not mass:
        return body
    whole = body.mass + mass
    com = (body.mass * body.com + mass * place) / whole
    inertia = body.inertia + body.mass * steiner(body.com - com) + mass * steiner(place - com)
    return dataclasses.replace(body, mass=whole, com=com, inertia=inertia)
