"""The identified parameters, and where they go in a simulator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.cause_words import joint_names
from clie_blocks.analysis.gap.report.exports import simulator_names
from clie_blocks.analysis.gap.report.joint_side import PLACES
from clie_blocks.analysis.gap.report.wording import (
    JOINT_PARAMETERS,
    Answer,
    Row,
    effect_title,
    join_words,
    number,
)
from clie_blocks.analysis.report.document import Section, Table
from clie_blocks.effects import LIBRARY

LEAST = 0.05  # probability from which the parameters of a cause are shown
OBSERVED = ("dead_time",)  # delay, lag and friction together: not a parameter of a simulator
ABSENT = 1e6  # a limit or an onset beyond it is never reached
TITLE = "Parameters for your simulator"
SIMULATORS = ("mujoco", "urdf", "isaac")
CHANGED = {"datasheet": "change of the nominal", "simulator": "add to your simulator",
           "loop": "add to your loop"}
ABSOLUTE = (
    "Joint side: motor torques times the gear ratio, but for gain, limit and times. The armature "
    "does not contain the inertia of stated links, since their bodies bring it. 'clie export' "
    "writes all of it as a model that runs, or into a model of yours.")
DIFFERENCES = (
    "Your simulator holds the rest already: add the changes to what it has; multiply its gain by "
    "the ratio of the new to the old one, and put a new limit in the place of the old one.")
JOINT_NAMES = {"inertia": ("joint armature", "<inertial>", "armature"),
               "damping": ("joint damping", "<dynamics damping>", "viscousFriction"),
               "load": ("motor biasprm, sign reversed", "none", "effort offset, sign reversed"),
               "mass": ("body inertial mass", "<inertial><mass>", "mass"),
               "torque": ("actuator gear or gainprm", "none", "scale of the effort")}


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
                   "Joint model, motor side, and masses of links: refitted, and as stated.")
    return Section("Identified parameters", (
        "The intervals hold if the cause is the right one; they are widened by what it leaves "
        "unexplained. A positive offset pushes backward.", *_per_unit_of_u(answer)),
        tables=(*tables, stated))


def _per_unit_of_u(answer: Answer) -> Iterator[str]:
    """That torques are no torques, and what to state to get them."""
    why = answer["export"]["not_exported"]
    if why:
        yield f"Torques, inertias and friction are per unit of u: {why}."


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
    export = answer["export"]
    if export["not_exported"]:
        return Section(TITLE, (f"Torques of this diagnosis are per unit of u. They are not "
                               f"exported, since {export['not_exported']}.",))
    changes = export["basis"] != "datasheet"
    shown = [row for row in export["joints"] if _is_shown(row, changes)]
    rows = tuple((row["joint"], row["parameter"], number(row["value"], 6), _change(row),
                  row["unit"], *(getattr(PLACES[row["parameter"]], name) for name in SIMULATORS))
                 for row in shown)
    head = ("joint", "parameter", "value", CHANGED[export["basis"]], "unit", "MuJoCo",
            "URDF or Gazebo", "Isaac")
    points = tuple(f"{name}: {PLACES[name].meaning}."
                   for name in dict.fromkeys(row["parameter"] for row in shown))
    points += tuple(_missing(row) for row in export["not_in_the_table"]) + tuple(
        f"Controller of {row['joint']}: {row['parameter']} {number(row['value'], 6)} "
        f"{row['unit']} ran, {number(row['stated'], 6)} stated." for row in export["controller"])
    return Section(TITLE, (DIFFERENCES if changes else ABSOLUTE,), points=points,
                   tables=(Table(head, rows),))


def _is_shown(row: Row, changes: bool) -> bool:
    """Whether a parameter is there, or has changed where the simulator holds the rest."""
    return bool(row["change"]) if changes else bool(row["value"] or row["before"])


def _change(row: Row) -> str:
    return "new" if row["before"] is None else number(row["change"], 6)


def _missing(row: Row) -> str:
    values = ", ".join(f"{name} {join_words(number(one, 6) for one in entry['value'])} "
                       f"{entry['unit']}" for name, entry in row["parameters"].items())
    return (f"Not in the table: {effect_title(row['effect'])} at {join_words(row['joints'])}, "
            f"{values}. MuJoCo: {simulator_names(row['effect'])[0]}.")
