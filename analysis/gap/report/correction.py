"""The corrected model as plain data, complete: what an export needs, and nothing of the logs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import GEAR_RATIO, is_number, ratio_change
from clie_blocks.analysis.gap.report.arm import IN_BODIES, arm
from clie_blocks.analysis.gap.report.exports import law_settings, member_settings
from clie_blocks.analysis.gap.report.joint_side import (
    entries,
    force_of,
    joint_torque,
    logged_command,
    only_differences,
    slides,
    turn,
    why_not_exported,
)
from clie_blocks.analysis.gap.report.uncertainty import Numbers, uncertainty
from clie_blocks.analysis.gap.report.wording import units_of
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import ClieError

UNCERTAIN = ("inertia", "beside_links", "damping", "offset", "gear", "gain", "torque")
IN_JOINTS = (GEAR_RATIO,)  # what the corrected joints hold


def correction(result: Result) -> dict[str, Any]:
    """Return the correction of one diagnosis: joints on the joint side, effects as settings.

    ``not_exported`` says why there is none.  Where a formula stands in the place of causes, its
    model is the correction.
    """
    result = result.with_formula
    why = why_not_exported(result)
    basis = "datasheet"
    if only_differences(result):
        basis = "simulator" if result.problem.simulated else "loop"
    plain: dict[str, Any] = {"basis": basis, "not_exported": why, "period": result.problem.period,
                             "joints": [], "effects": [], "of_links": [], "of_law": [],
                             "without_block": []}
    if why is not None:
        return plain
    found, without = _settings(result)
    joints = _joints(result)
    named = law_settings(result.controller.named, result.problem.n)
    return plain | {"joints": joints, "effects": [_plain(one) for one in found],
                    "of_links": _of_links(result),
                    "of_law": [_plain(one) for one in named], "without_block": without,
                    "arm": arm(result), "uncertainty": uncertainty(result, _numbers)}


def _numbers(result: Result) -> Numbers:
    """What the logs may leave uncertain: of joints, ``joint.NAME.KEY``, and of effects."""
    found, _ = _settings(result)
    numbers = {f"joint.{row['name']}.{key}": float(row[key])
               for row in _joints(result) for key in UNCERTAIN}
    for place, setting in enumerate(found):
        for key, value in setting.values.items():
            numbers |= {f"effect.{place}.{key}.{k}": float(one)
                        for k, one in enumerate(np.ravel(np.asarray(value, float)))}
    return numbers


def _settings(result: Result) -> tuple[list[Setting], list[dict[str, Any]]]:
    """Causes as effects of the catalogue, and why some are none; those of the datasheet too."""
    hypothesis = result.model.hypothesis
    members = hypothesis.members if only_differences(result) else hypothesis.all_members
    found: list[Setting] = []
    without: list[dict[str, Any]] = []
    for member in members:
        joints = [hypothesis.problem.joints[k] for k in member.joints]
        if is_number(member.cause):
            if member.cause.variant not in IN_JOINTS:
                without.append({"effect": member.cause.variant, "joints": joints, "why":
                                "a number of the robot file that is off; correct it in the model, "
                                "by the table of stated and identified numbers in the report",
                                "in_bodies": True})
            continue
        if member.cause.name == "coupling":
            without.append({"effect": member.cause.name, "joints": joints, "why":
                            "the bodies of your model have it, where they are the links that the "
                            "robot file states", "in_bodies": True})
            continue
        try:
            found += member_settings(member, hypothesis.problem, hypothesis.of_log(0))
        except ClieError as error:
            without.append({"effect": member.cause.name, "joints": joints, "why": str(error),
                            "in_bodies": member.cause.name in IN_BODIES})
    return found, without


def _of_links(result: Result) -> list[str]:
    """Effects whose load is the weight of the links, in the place of the torque of the motor."""
    return [member.cause.name for member in result.model.hypothesis.members
            if member.cause.variant == "links"]


def _joints(result: Result) -> list[dict[str, Any]]:
    """Each joint: its model in N m or N, rad or m, and the factors that bring it there."""
    hypothesis = result.model.hypothesis
    problem, values = hypothesis.problem, hypothesis.values
    torque, force = joint_torque(problem, values), force_of(problem)
    command, unit_u = logged_command(problem)
    unit_q = units_of(problem.records)["q"] if problem.records else "rad"
    change, rows = ratio_change(values, problem.n), entries(result)
    row = {(entry.joint, entry.parameter): entry for entry in rows}
    return [{
        "name": name, "kind": "slide" if slides(problem, k) else "hinge",
        "units": {"q": "m" if slides(problem, k) else _angle(unit_q), "u": unit_u[k]},
        "zero": turn(problem)[k], "gear_ratio": problem.gear_ratio[k],
        "encoder": "motor" if problem.encoder_on_motor else "link",
        "gear": change[k] * problem.gear_ratio[k], "gain": force[k] * command[k],
        "torque": torque[k], "command": command[k],
        "inertia": torque[k] * values["inertia"][k],
        "beside_links": row[name, _inertia(problem, k)].value,
        "links_known": bool(problem.links.known),
        "damping": row[name, "damping"].value, "offset": -torque[k] * values["load"][k],
        "before": {key: row[name, key].before for key in (
            _inertia(problem, k), "damping", "offset", "gear", "gain", "frictionloss")}}
        for k, name in enumerate(problem.joints)]


def _angle(unit: str) -> str:
    return unit if unit in ("rad", "m") else "rad"


def _inertia(problem: Any, k: int) -> str:
    return "mass" if slides(problem, k) else "armature"


def _plain(setting: Setting) -> dict[str, Any]:
    """An effect with its parameters: those per joint as one value per joint of the robot."""
    values: Mapping[str, Any] = setting.values
    return {"effect": setting.effect.name,
            "joints": None if setting.joints is None else [k + 1 for k in setting.joints],
            "parameters": {key: np.asarray(value, float).tolist()
                           for key, value in values.items()}}
