"""What the diagnosis says of one run of a machine, as its user would have asked."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.real.truth import ROBOT, Machine, Run
from clie_blocks.errors import RecordError, nearest

if TYPE_CHECKING:
    from clie_blocks.analysis.records import Record, Robot

LOAD = "payload"  # what a comparison finds


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A value of an answer with its 90 % interval; what has no interval has its value for both."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Answer on a run.

    Parameters
    ----------
    answer : dict
        JSON object of ``clie diagnose``, or one that says as much of a comparison.
    quantities : dict
        Values by ``effect.parameter``, or by the name of what was measured.
    joints : tuple of str
        Names of the joints that the answer counts from 1.

    """

    answer: dict[str, Any]
    quantities: dict[str, Quantity]
    joints: tuple[str, ...]


def outcome_of(machine: Machine, run: Run, seconds: float) -> Outcome:
    """Diagnose a run, or compare its two sides.

    Raises
    ------
    RecordError
        If its logs or its robot file are not found, or cannot be read.
    ClieError
        If the logs cannot be diagnosed.

    """
    robot = _robot(machine, run)
    records = _records(machine, run, run.logs, robot)
    if run.unloaded:
        return _compared(robot, records, _records(machine, run, run.unloaded, robot))
    from clie_blocks.analysis.gap.problem.locked_output import is_locked, twists

    if robot is not None and all(is_locked(record, robot) for record in records):
        return _twisted([twist for record in records for twist in twists(record)])
    return _diagnosed(run, robot, records, seconds)


def _diagnosed(run: Run, robot: Robot | None, records: Sequence[Record],
               seconds: float) -> Outcome:
    from clie_blocks.analysis.gap.diagnosis import diagnose

    problem = _problem(robot, records)
    answer = diagnose(problem, exclude=run.exclude, seconds=seconds).to_dict()
    return Outcome(answer, dict(_parameters(answer)), problem.joints)


def _problem(robot: Robot | None, records: Sequence[Record]) -> Any:
    from clie_blocks.analysis.gap.problem.problem import Problem

    stated = robot or records[0].robot
    if stated is None:
        raise RecordError(f"{records[0].source}: the robot is not described; write robot = "
                          "\"robot.toml\" into the run, a file beside its truth")
    return Problem.from_logs(stated, records)


def _parameters(answer: dict[str, Any]) -> Iterator[tuple[str, Quantity]]:
    """Largest of each parameter over the joints, with its interval."""
    for row in answer["effects"]:
        for name, entry in (row.get("parameters") or {}).items():
            values = np.atleast_1d(np.array(entry["value"], float))
            low, high = (np.atleast_1d(np.array(side, float))
                         for side in entry.get("interval") or (values, values))
            k = int(np.argmax(np.abs(values)))
            yield f"{row['effect']}.{name}", Quantity(*(float(x.flat[k]) for x in
                                                        (values, low, high)))


def _compared(robot: Robot | None, loaded: Sequence[Record],
              unloaded: Sequence[Record]) -> Outcome:
    from clie_blocks.analysis.gap.load_comparison.compare import compare_loads

    found = compare_loads(_problem(robot, loaded), _problem(robot, unloaded))
    stored = found.to_dict()
    joint = [len(found.joints)]
    answer = _certain(stored["verdict"], LOAD if found.is_load else "none", joint)
    return Outcome(answer, {name: Quantity(float(stored[name]["value"]),
                                           *map(float, stored[name]["interval"]))
                            for name in ("mass", "distance", "moment")}, found.joints)


def _twisted(found: Sequence[Any]) -> Outcome:
    """Lost motion [rad] and stiffness [N m/rad] of the first locked joint."""
    from clie_blocks.analysis.gap.problem.locked_output import LOCKED

    twist = found[0]
    low, median, high = twist.lost_motion
    answer = _certain(LOCKED, "none")
    quantities = {"lost_motion": Quantity(median, low, high),
                  "stiffness": Quantity(float(np.mean(twist.stiffness)), *sorted(twist.stiffness)),
                  "breakaway": Quantity(*[float(twist.breakaway)] * 3)}
    return Outcome(answer, quantities, (twist.joint,))


def _certain(verdict: str, effect: str, joint: Sequence[int] | None = None) -> dict[str, Any]:
    """Answer of a measurement, which weighs no other cause against what it finds."""
    return {"verdict": verdict, "unexplained": False, "set_90": [effect],
            "effects": [{"effect": effect, "joint": joint, "probability": 1.0}]}


def _robot(machine: Machine, run: Run) -> Robot | None:
    from clie_blocks.analysis.records import read_robot

    path = machine.truth / (run.robot or ROBOT)
    if not run.robot and not path.is_file():
        return None
    return read_robot(path)


def _records(machine: Machine, run: Run, parts: Sequence[str],
             robot: Robot | None) -> list[Record]:
    """Logs of a run, each the first whose name has a part in it."""
    from clie_blocks.analysis.records.read import read_logs, read_records

    if not _is_data_set(machine.logs):
        if run.joints:
            raise RecordError(f"{machine.logs}: joints = [..] of run {run.name!r} takes joints "
                              "of a data set; name the columns of these logs in [columns] of "
                              "the robot file")
        paths = sorted(path for path in machine.logs.iterdir() if path.suffix != ".toml")
        names = [path.name for path in paths]
        return read_logs([paths[_first(part, names, machine)] for part in parts], robot)
    records = read_records(machine.logs)
    names = [record.source for record in records]
    chosen = [records[_first(part, names, machine)] for part in parts]
    if run.joints:
        chosen = [record.of_joints(run.joints) for record in chosen]
    return [record if robot is None else record.of_robot(robot) for record in chosen]


def _is_data_set(folder: Path) -> bool:
    from clie_blocks.analysis.records.folder import contents

    return contents(folder).data_set


def _first(part: str, names: Sequence[str], machine: Machine) -> int:
    for i, name in enumerate(names):
        if part in name:
            return i
    raise RecordError(f"{machine.logs}: no log of {machine.name!r} has {part!r} in its name; "
                      f"{nearest(part, names)}")
