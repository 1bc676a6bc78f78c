"""The target ``mujoco`` as files: the patched model, the original, its change, and the module."""

from __future__ import annotations

from collections.abc import Mapping
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

MODULE = "corrected_joints"
DRIVEN = "corrected_joints.json"


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
    files: dict[str, str | bytes] = {name: found.text, DRIVEN: to_json(_plain(found, name))}
    if model:
        files |= {f"{path.stem}.original.xml": text, f"{path.stem}.diff": diff}
    if found.needs_module:
        files[f"{MODULE}.py"] = module(correction, found, name)
    return Exported("mujoco", files, found.notes, diff,
                    "MuJoCo loads the corrected model; clie replay runs it against a log.")


def module(correction: Correction, found: CorrectedModel, source: str) -> str:
    """Return the Python module that runs the blocks beside a corrected model."""
    rows: list[dict[str, Any]] = []
    for k, (piece, driven) in enumerate(zip(found.splits, found.driven, strict=True)):
        alone = piece.apart is not None
        made = core(joint_block(correction, k, found.step, piece.block, whole=alone))
        joint = piece.joint
        rows.append({"core": made, "driven": driven, "alone": alone,
                     "drive": joint.gear * joint.gain, "friction": piece.friction_in_block,
                     "sees_robot": made.block.sees_robot})
    return fill("mujoco_module.py.j2", joints=rows, step=found.step, source=source, module=MODULE,
                on_motor=[joint.encoder == "motor" for joint in correction.joints])


def _plain(found: CorrectedModel, name: str) -> dict[str, Any]:
    return {"schema_version": 1, "model": name, "step": found.step,
            "module": f"{MODULE}.py" if found.needs_module else None,
            "joints": [{"name": piece.joint.name, "motor": driven.joint, "joint": driven.link,
                        "actuator": driven.actuator or None,
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
                       for k, (piece, driven) in enumerate(
                           zip(found.splits, found.driven, strict=True))]}
