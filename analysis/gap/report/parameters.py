"""The identified parameters, and where they go in a simulator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.exports import force_per_command, joint_side, simulator_names
from clie_blocks.analysis.gap.report.summary import joint_names
from clie_blocks.analysis.gap.report.wording import (
    JOINT_PARAMETERS,
    Answer,
    Row,
    effect_title,
    number,
    simulator_units,
    units_of,
)
from clie_blocks.analysis.report.document import Section, Table
from clie_blocks.effects import LIBRARY

LEAST = 0.05  # probability from which the parameters of a cause are shown
OBSERVED = ("dead_time",)  # delay, lag and friction together: not a parameter of a simulator
ABSENT = 1e6  # a limit or an onset beyond it is never reached
JOINT_NAMES = {"inertia": ("joint armature", "<inertial>", "armature"),
               "damping": ("joint damping", "<dynamics damping>", "viscousFriction"),
               "load": ("qfrc_applied", "none", "none")}


def parameters_section(answer: Answer) -> Section:
    """Parameters of the likely causes and of the joint model, with intervals and names."""
    joints = joint_names(answer)
    rows = [row for effect in answer["effects"] if effect["probability"] >= LEAST
            for row in _effect_rows(effect, joints)]
    model = [row for name, entry in answer["joint_model"].items()
             for row in _model_rows(name, entry, joints)]
    head = ("parameter", "joint", "value", "95 % interval", "unit", "MuJoCo", "URDF or Gazebo",
            "Isaac")
    tables = [Table(head, tuple(rows), "Causes, motor side.")] if rows else []
    stated = Table((*head[:3], "95 % interval", "stated", *head[4:]), tuple(model),
                   "Joint model, motor side: refitted, and as stated.")
    return Section("Identified parameters", (
        "The intervals hold if the cause is the right one; they are widened by what it leaves "
        "unexplained.",), tables=(*tables, stated))


def _effect_rows(effect: Row, joints: Sequence[str]) -> Iterator[tuple[str, ...]]:
    names = (simulator_names(effect["effect"]) if effect["effect"] in LIBRARY
             else ("none",) * 3)
    for name, entry in effect.get("parameters", {}).items():
        if name in OBSERVED:
            continue
        value = np.atleast_1d(np.asarray(entry["value"], float))
        bounds = _bounds(entry.get("interval"), value)
        for where, one, low, high in _entries(value, bounds, effect["joint"], joints):
            if abs(one) < ABSENT:
                yield (f"{effect_title(effect['effect'])}: {effect_title(name)}", where,
                       number(one, 4), _interval(low, high), entry["unit"], *names)


def _bounds(interval: Any, value: np.ndarray) -> np.ndarray:
    if interval is None:
        return np.full((2, *value.shape), np.nan)
    return np.array([np.broadcast_to(np.asarray(bound, float), value.shape)
                     for bound in interval])


def _entries(value: np.ndarray, bounds: np.ndarray, at: Sequence[int], joints: Sequence[str]
             ) -> Iterator[tuple[str, float, float, float]]:
    """One entry per joint, and per log for parameters that differ between logs."""
    for index in np.ndindex(value.shape):
        name = joints[at[index[-1]] - 1] if value.shape[-1] == len(at) else "all"
        log = f", log {index[0] + 1}" if value.ndim == 2 else ""
        low, high = bounds[(slice(None), *index)]
        yield f"{name}{log}", float(value[index]), float(low), float(high)


def _interval(low: float, high: float) -> str:
    return "-" if not np.isfinite(low + high) else f"{number(low, 5)} .. {number(high, 5)}"


def _model_rows(name: str, entry: Mapping[str, Any], joints: Sequence[str]
                ) -> Iterator[tuple[str, ...]]:
    for k, joint in enumerate(joints):
        low, high = (bound[k] for bound in entry["interval"])
        yield (JOINT_PARAMETERS.get(name, name), joint, number(entry["value"][k], 4),
               _interval(low, high), number(entry["stated"][k], 4), entry["unit"],
               *JOINT_NAMES[name])


def simulator_section(result: Result, answer: Answer) -> Section | None:
    """The corrected joints as a simulator of joints takes them; None without a correction."""
    if answer["verdict"] in ("none", "unexplained"):
        return None
    units = units_of(result.problem.records)
    named = simulator_units(units)
    force, rate = named["force"], f"{units['q']}/s"
    shown = (("armature", named["inertia"], "joint armature", "-", "armature"),
             ("damping", f"{force}/({rate})", "joint damping", "<dynamics damping>",
              "viscousFriction"),
             ("frictionloss", force, "joint frictionloss", "<dynamics friction>",
              "dynamicFrictionEffort"),
             ("gear", "1", "motor gear", "mechanicalReduction", "scale of the effort"),
             ("limit", force, "motor forcerange", "<limit effort>", "effort_limit"),
             ("delay", "s", "actuator delay", "-", "DelayedPDActuator max_delay"))
    joints = joint_side(result, force_per_command(result))
    rows = tuple((row["name"], number(row[key], 4), unit, *names)
                 for row in joints for key, unit, *names in shown if row[key] is not None)
    return Section(
        "Parameters for your simulator",
        ("Joint side: motor torques times the gear ratio. The armature does not contain the "
         "inertia of stated links, since their bodies bring it. The .xml file next to this page "
         "holds the same values as MuJoCo text.",),
        tables=(Table(("joint", "value", "unit", "MuJoCo", "URDF or Gazebo", "Isaac"), rows),))
