"""The numbers that were found, and where they go in a simulator."""

import numpy as np

from clie_blocks.analysis.gap.report.exports import force_per_command, joint_side, simulator_names
from clie_blocks.analysis.gap.report.wording import (
    effect_title,
    local_unit,
    number,
    simulator_units,
    units_of,
)
from clie_blocks.analysis.report.document import Section, Table
from clie_blocks.effects import LIBRARY

LEAST = 0.05  # probability from which a cause's numbers are shown
OBSERVED = ("dead_time",)  # comes of delay, lag and friction together: no simulator takes it
ABSENT = 1e6  # a limit or an onset beyond it is never reached
JOINT_NAMES = {"inertia": ("joint armature", "<inertial>", "armature"),
               "damping": ("joint damping", "<dynamics damping>", "viscousFriction"),
               "load": ("qfrc_applied", "none", "none")}


def parameters_section(diagnosis, answer, units):
    """Numbers of the likely causes and of the joint model, with intervals and names."""
    joints = diagnosis.problem.joints
    rows = [row for effect in answer["effects"] if effect["probability"] >= LEAST
            for row in _effect_rows(effect, joints, units)]
    model = [row for name, entry in answer["joint_model"].items()
             for row in _model_rows(name, entry, joints, units)]
    head = ("number", "joint", "value", "95 % interval", "unit", "MuJoCo", "URDF or Gazebo",
            "Isaac")
    tables = [Table(head, tuple(rows), "Of the causes, motor side.")] if rows else []
    stated = Table((*head[:3], "95 % interval", "stated", *head[4:]), tuple(model),
                   "Of the joint model, motor side: refitted, and as stated.")
    return Section("Numbers", (
        "Intervals hold if the cause is the right one; they are widened by what it leaves "
        "unexplained.",), tables=(*tables, stated))


def _effect_rows(effect, joints, units):
    names = (simulator_names(effect["effect"]) if effect["effect"] in LIBRARY
             else ("none",) * 3)
    for name, entry in effect.get("parameters", {}).items():
        if name in OBSERVED:
            continue
        value = np.atleast_1d(np.asarray(entry["value"], float))
        bounds = _bounds(entry.get("interval"), value)
        for where, one, low, high in _entries(value, bounds, effect["joint"], joints):
            if abs(one) < ABSENT:
                yield (f"{effect_title(effect['effect'])}: {name}", where, number(one, 4),
                       _interval(low, high), local_unit(entry["unit"], units), *names)


def _bounds(interval, value):
    if interval is None:
        return np.full((2, *value.shape), np.nan)
    return np.array([np.broadcast_to(np.asarray(bound, float), value.shape)
                     for bound in interval])


def _entries(value, bounds, at, joints):
    """One entry per joint, and per log for numbers that differ between logs."""
    for place in np.ndindex(value.shape):
        name = joints[at[place[-1]] - 1] if value.shape[-1] == len(at) else "all"
        log = f", log {place[0] + 1}" if value.ndim == 2 else ""
        yield f"{name}{log}", value[place], bounds[0][place], bounds[1][place]


def _interval(low, high):
    return "-" if not np.isfinite(low + high) else f"{number(low, 5)} .. {number(high, 5)}"


def _model_rows(name, entry, joints, units):
    for k, joint in enumerate(joints):
        low, high = (bound[k] for bound in entry["interval"])
        yield (name, joint, number(entry["value"][k], 4), _interval(low, high),
               number(entry["stated"][k], 4), local_unit(entry["unit"], units),
               *JOINT_NAMES[name])


def simulator_section(diagnosis, answer, records):
    """The corrected joints as a simulator of joints takes them."""
    if answer["verdict"] in ("none", "unexplained"):
        return None
    units = units_of(records)
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
    numbers = joint_side(diagnosis, force_per_command(diagnosis, records))
    rows = tuple((row["name"], number(row[key], 4), unit, *names)
                 for row in numbers for key, unit, *names in shown if row[key] is not None)
    return Section(
        "Put these numbers into the simulator",
        ("Joint side: torques of the motor times the gear ratio. The inertia of links that are "
         "stated is not in the armature, since it comes with their bodies. The file ending in "
         ".xml beside this page holds the same as MuJoCo text.",),
        tables=(Table(("joint", "value", "unit", "MuJoCo", "URDF or Gazebo", "Isaac"), rows),))
