"""A MuJoCo model to be corrected where the user has none: the stated links, or joints alone."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from clie_blocks.analysis.export.arm import Arm
from clie_blocks.analysis.export.correction import Correction, before
from clie_blocks.analysis.export.mjcf_elements import TINY, point_mass, tag

LONGEST_STEP = 1.25e-4  # s: dry friction then holds as in the corrected model


def stub(correction: Correction) -> str:
    """Return the text of a model that has the joints of a correction, as the datasheet has them.

    Links are those that were stated, with what was identified of them, and gravity points down;
    without stated links each joint has a body of next to no mass, side by side.
    """
    step = correction.period / math.ceil(correction.period / LONGEST_STEP - 1e-9)
    arm = correction.arm
    weight = 0.0 if arm is None else float(np.linalg.norm(arm.gravity))
    bodies = _side_by_side(correction) if arm is None else _links(correction, arm)
    return tag("mujoco", {"model": "robot"}, [
        tag("compiler", {"angle": "radian", "autolimits": "true"}),
        tag("option", {"timestep": step, "integrator": "RK4",
                       "gravity": f"0 0 {0.0 - weight:.9g}"}),
        tag("worldbody", {}, bodies),
        *_tendons(correction),
        tag("actuator", {}, [tag("general", {
            "name": joint.name, "tendon" if correction.tendons else "joint": joint.name,
            "gear": before(joint, "gear"), "gainprm": before(joint, "gain")})
            for joint in correction.joints])]) + "\n"


def _side_by_side(correction: Correction) -> list[str]:
    """Bodies of joints without links; one that slides has its mass.

    The engine measures its dry friction by the mass of the body, without the armature.
    """
    return [tag("body", {"pos": f"0 {k} 0"}, [
        point_mass(joint.inertia if joint.slides else TINY),
        tag("joint", {"name": joint.name, "type": joint.kind,
                      "axis": "0 1 0" if joint.slides else "0 -1 0"})])
        for k, joint in enumerate(correction.joints)]


def _links(correction: Correction, arm: Arm) -> list[str]:
    """Bodies of the links, each inside that which carries it."""
    inside: list[list[str]] = [[] for _ in arm.bodies]
    if arm.payload:
        inside[-1] = [tag("body", {"name": "payload", "pos": _numbers(arm.tip)},
                          [point_mass(arm.payload)])]
    roots: list[str] = []
    for k, body in reversed(list(enumerate(arm.bodies))):
        joint = correction.joints[k]
        reads = {"ref": body.reads_zero_at} if body.reads_zero_at else {}
        inertia = body.inertia + TINY * np.array([1, 1, 1, 0, 0, 0])
        text = tag("body", {"pos": _numbers(body.offset), "quat": _quaternion(body.rotation)}, [
            tag("inertial", {"pos": _numbers(body.com), "mass": max(body.mass, TINY),
                             "fullinertia": _numbers(inertia)}),
            tag("joint", {"name": joint.name, "type": joint.kind, "axis": "0 0 1", **reads}),
            *inside[k]])
        (roots if body.parent < 0 else inside[body.parent]).insert(0, text)
    return [tag("body", {"name": "base", "quat": _quaternion(_upright(arm.gravity))}, roots)]


def _upright(gravity: np.ndarray) -> np.ndarray:
    """Rotation of the base that lets gravity point down."""
    from scipy.spatial.transform import Rotation

    if not np.any(gravity):
        return np.eye(3)
    found, _ = Rotation.align_vectors([[0.0, 0.0, -1.0]], [gravity / np.linalg.norm(gravity)])
    return np.asarray(found.as_matrix())


def _quaternion(rotation: np.ndarray) -> str:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return _numbers((w, x, y, z))


def _tendons(correction: Correction) -> list[str]:
    """Motors that turn several joints: each a tendon, as long as the motor has turned."""
    if correction.tendons is None:
        return []
    return [tag("tendon", {}, [fixed_tendon(name, zip(correction.names, row))
                               for name, row in zip(correction.names, correction.tendons)])]


def fixed_tendon(name: str, shares: Iterable[tuple[str, float]]) -> str:
    """Return a tendon whose length is the position of a motor over its gear ratio."""
    return tag("fixed", {"name": name}, [tag("joint", {"joint": joint, "coef": share})
                                         for joint, share in shares if share])


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{float(value):.9g}" for value in values)
