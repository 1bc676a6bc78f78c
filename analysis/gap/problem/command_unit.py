"""Commands that are no torque, beside a datasheet in kg m^2 and N m.

A current, a voltage or a percentage becomes the torque that it is worth by the robot file.  Where
that says nothing of it, its links may: then the torque is known with a tolerance.  Else torques
stay per unit of command, and the datasheet is not used.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.problem.torque_by_links import TOLERANCE, torque_by_links
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.command_unit import force_per_command, missing_force
from clie_blocks.analysis.records.robot_sections import Links, Motor
from clie_blocks.analysis.records.units import FORCES
from clie_blocks.errors import RecordError

Stated = tuple[Robot, list[Record]]


def in_one_unit(robot: Robot, records: Sequence[Record]) -> Stated:
    """Return robot and records whose commands and datasheet are in one unit.

    Raises
    ------
    RecordError
        If gravity of the links is known in N m, and the command in a unit of its own.

    """
    first = records[0].replace(robot=robot)
    if all(unit in FORCES for unit in first.units["u"]) or not _has_datasheet(robot):
        return robot, list(records)
    force = force_per_command(first)
    if force is not None:
        return _as_torque(robot, records, force, "by the robot file")
    force = torque_by_links(robot, records)
    if force is None:
        return _without_datasheet(robot, records, missing_force(first) or "")
    within = dataclasses.replace(robot.motor, torque_constant_tolerance=TOLERANCE)
    return _as_torque(dataclasses.replace(robot, motor=within), records, force,
                      f"by the links of the robot file, within {100 * TOLERANCE:.0f} %")


def _has_datasheet(robot: Robot) -> bool:
    """Whether inertia of motors or links is stated, in kg m^2."""
    return (robot.motor.inertia is not None or robot.links.mass is not None
            or robot.tree is not None)


def _as_torque(robot: Robot, records: Sequence[Record], force: np.ndarray, by: str) -> Stated:
    """Commands, gains and limits as torques [N m] or forces [N]."""
    law = robot.controller
    factors: dict[str, Any] = {
        name: getattr(law, name) * force
        for name in ("kp", "ki", "kd", "kv", "saturation", "command_resolution", "punch",
                     "command_rate")
        if getattr(law, name) is not None and not (name == "kp" and law.law == "cascade")}
    if law.feedforward is not None:
        factors["feedforward"] = {name: value if name == "width_rad_s" else value * force
                                  for name, value in law.feedforward.items()}
    if law.block is not None:
        factors["block_scale"] = force
    largest = robot.limits.command
    stated = dataclasses.replace(
        robot, controller=dataclasses.replace(law, **factors),
        limits=dataclasses.replace(robot.limits,
                                   command=None if largest is None else largest * force),
        motor=dataclasses.replace(robot.motor, torque_gain=None))
    return stated, [_record_as_torque(record, stated, force, by) for record in records]


def _record_as_torque(record: Record, robot: Robot, force: np.ndarray, by: str) -> Record:
    unit = tuple("N" if q == "m" else "N m" for q in record.units["q"])
    worth = ", ".join(f"{x:.4g} {new} per {old} at {name}" for x, new, old, name in zip(
        force, unit, record.units["u"], record.joints, strict=True))
    return record.replace(
        u=None if record.u is None else record.u * force,
        pe=None if record.pe is None else record.pe * force, robot=robot,
        units={**record.units, "u": unit, "pe": unit}).noted(
            f"u is no torque: it is taken as one {by}, {worth}.")


def _without_datasheet(robot: Robot, records: Sequence[Record], why: str) -> Stated:
    """Robot without numbers that a command in a unit of its own cannot be compared with."""
    if robot.nominal.gravity:
        raise RecordError(
            f"{records[0].source}: {why}. The weight of the links is stated in N m and cannot be "
            "compared with u, so that gravity would be taken for an effect")
    bare = dataclasses.replace(
        robot, motor=Motor(gear_ratio=robot.motor.gear_ratio),
        links=Links(length=robot.links.length), tree=None,
        nominal=dataclasses.replace(robot.nominal, coupling=False))
    note = ("The inertias of the robot file, in kg m^2, cannot be compared with u and were left "
            f"out: {why}.")
    return bare, [record.replace(robot=bare).noted(note) for record in records]
