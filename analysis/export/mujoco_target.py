"""The target ``mujoco`` as files: the patched model, the original, its change, and the module."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from clie_blocks.analysis.export.core import core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.events import MOMENTS, phases_of
from clie_blocks.analysis.export.exported import Exported, read_model, unified_diff
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.analysis.export.mujoco_model import CorrectedModel, corrected_model
from clie_blocks.analysis.export.mujoco_stub import stub
from clie_blocks.output import to_json
from clie_blocks.rigid_body.motor_coupling import inverse_of

MODULE = "corrected_joints"
DRIVEN = "corrected_joints.json"
SCHEMA_VERSION = 2  # of that file


def export_mujoco(correction: Correction, model: str | PathLike[str] | None = None,
                  renamed: Mapping[str, str] | None = None) -> Exported:
    """Return the correction as a MuJoCo model.

    Parameters
    ----------
    correction : Correction
        What to bring in.
    model : path-like, optional
        The user's MJCF; by default one of the stated links, or of joints alone where none are.
    renamed : dict of str to str, optional
        Name in the model by name in the logs.

    Returns
    -------
    Exported
        ``NAME.corrected.xml``, and of a model ``NAME.original.xml`` and ``NAME.diff``; the module
        ``corrected_joints.py`` where the model has no words for an effect; and
        ``corrected_joints.json``, which says how each joint is driven.

    """
    if model is None:
        text, path, folder = stub(correction), Path("robot.xml"), None
        correction = correction.beside_arm
    else:
        path = Path(model)
        text = read_model(path, "the MJCF of the robot", "one of the stated links")
        folder = path.parent
    found = corrected_model(correction, text, path.name, folder, renamed)
    name = f"{path.stem}.corrected.xml"
    diff = unified_diff(text, found.text, path.name, name) if model else ""
    files: dict[str, str | bytes] = {
        name: found.text, DRIVEN: to_json(_plain(correction, found, name))}
    if model:
        files |= {f"{path.stem}.original.xml": text, f"{path.stem}.diff": diff}
    if found.needs_module:
        files[f"{MODULE}.py"] = module(correction, found, name)
    return Exported("mujoco", files, found.notes, diff,
                    "MuJoCo loads the corrected model; clie replay runs it against a log.")


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a motor and its encoder are in a model, as shares of joints by their names there.

    Parameters
    ----------
    motor, link : dict
        How the joints move the motor, and what it turns: another joint behind an elastic gear.
    weight : dict
        How the torques of the joints pull at the motor.
    seen : dict
        What the encoder sees.
    tendon : str
        The tendon that is the motor of several joints; empty where it is that of one.

    """

    motor: dict[str, float]
    link: dict[str, float]
    weight: dict[str, float]
    seen: dict[str, float]
    tendon: str


def places(correction: Correction, found: CorrectedModel) -> list[Place]:
    """Return the place of each motor in a corrected model."""
    joints = [driven.link for driven in found.driven]
    on_motor = [joint.encoder == "motor" for joint in correction.joints]
    if correction.coupling is None:
        return [Place({driven.joint: 1.0}, {driven.link: 1.0}, {driven.link: 1.0},
                      {driven.joint if encoder and piece.apart is None else driven.link: 1.0}, "")
                for piece, driven, encoder in zip(found.splits, found.driven, on_motor)]
    motors, pulls = inverse_of(correction.coupling), tuple(zip(*correction.coupling))
    stated = None if correction.arm is None else correction.arm.motor_coupling
    own = [tuple(float(i == k) for i in range(len(joints))) for k in range(len(joints))]
    links = own if stated is None else inverse_of(stated)

    def by_name(shares: Sequence[float]) -> dict[str, float]:
        return {name: share for name, share in zip(joints, shares) if share}

    return [Place(by_name(motors[k]), by_name(motors[k]), by_name(pulls[k]),
                  by_name(motors[k] if on_motor[k] else links[k]), name)
            for k, name in enumerate(joints)]


def module(correction: Correction, found: CorrectedModel, source: str) -> str:
    """Return the Python module that runs the blocks beside a corrected model."""
    rows: list[dict[str, Any]] = []
    for k, (piece, driven, place) in enumerate(zip(
            found.splits, found.driven, places(correction, found), strict=True)):
        alone = piece.apart is not None
        made = core(joint_block(correction, k, found.step, piece.block, whole=alone))
        joint = piece.joint
        rows.append({"core": made, "driven": driven, "place": place, "alone": alone,
                     "drive": joint.gear * joint.gain, "friction": piece.friction_in_block,
                     "sees_robot": made.block.sees_robot})
    return fill("mujoco_module.py.j2", joints=rows, step=found.step, source=source, module=MODULE)


def _plain(correction: Correction, found: CorrectedModel, name: str) -> dict[str, Any]:
    return {"schema_version": SCHEMA_VERSION, "model": name, "step": found.step,
            "module": f"{MODULE}.py" if found.needs_module else None,
            "joints": [{"name": piece.joint.name, "motor": driven.joint, "joint": driven.link,
                        "seen": place.seen, "actuator": driven.actuator or None,
                        "control_per_command": driven.control,
                        "native": [one.effect.name for one in piece.native],
                        "extra_body": [one.effect.name for one in (*piece.bodies, *(
                            [piece.gear] if piece.gear else []))],
                        "module": [one.effect.name for one in piece.block],
                        "events": [f"{one.name}.{MOMENTS[one.effect.name]}"
                                   for one in piece.block if one.effect.name in MOMENTS],
                        "phases": [{"name": one.name, "values": one.values, "active": one.active}
                                   for one in phases_of(piece.block, piece.joint.name, k,
                                                        len(found.splits))]}
                       for k, (piece, driven, place) in enumerate(zip(
                           found.splits, found.driven, places(correction, found), strict=True))]}
