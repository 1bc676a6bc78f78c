"""SAGE logs (github.com/isaac-sim2real/sage): ``control.csv`` and ``state_motor.csv`` in a folder.

Both hold ``type,timestamp,positions,...`` with quoted lists; stamps are in microseconds for a real
robot and, depending on the writer, in seconds for a simulation.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.assemble import assemble
from clie_blocks.analysis.records.model import Record, read_only
from clie_blocks.analysis.records.readers import csv_text
from clie_blocks.analysis.records.readers.options import Options
from clie_blocks.analysis.records.resampling import hold_last
from clie_blocks.analysis.records.table import Table
from clie_blocks.errors import RecordError

MAP = {"time": "timestamp", "q": "positions[{k}]"}
STATE = {**MAP, "dq": "velocities[{k}]", "tau": "torques[{k}]"}
SLOWEST = 10.0  # s; a median step beyond this is in microseconds


def read(path: Path, options: Options) -> list[Record]:
    """Return the record of a SAGE folder, or of its ``state_motor.csv`` alone.

    The goal that was in force at a state is the last one written at or before its stamp.

    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    state = folder / "state_motor.csv" if path.is_dir() else path
    record = _timed(state, STATE, options)
    control = folder / "control.csv"
    if state.name == "state_motor.csv" and control.is_file():
        record = _with_goal(record, _timed(control, MAP, options), control)
    names = _joint_names(folder / "joint_list.txt", record.n)
    return [record.replace(joints=names or record.joints)]


def _timed(path: Path, columns: Mapping[str, str], options: Options) -> Record:
    (table,) = csv_text.read(path, options)
    present = {signal: pattern for signal, pattern in columns.items()
               if any(name.startswith(pattern.split("[")[0]) for name in table.names)}
    unit = options.time_unit or _unit(table)
    table = dataclasses.replace(table, time_unit=unit)
    table.decisions.append(f"Took SAGE's clock to be in {unit}, from the size of its steps.")
    return assemble(table, None, {**present, **(options.columns or {})})


def _unit(table: Table) -> str:
    """Unit of the clock: no robot logs slower than SLOWEST, none faster than 100 kHz."""
    if "timestamp" not in table.names:
        raise RecordError(f"{table.source} begins like a SAGE log but has no column "
                          "'timestamp'; export it again with its stamps")
    stamps = next(table.blocks([table.names.index("timestamp")]), np.empty((0, 1)))[:, 0]
    step = np.diff(stamps[np.isfinite(stamps)])
    step = step[step > 0]
    return "us" if step.size and np.median(step) > SLOWEST else "s"


def _with_goal(record: Record, control: Record, path: Path) -> Record:
    if control.n != record.n:
        raise RecordError(f"{path} has {control.n} joints, state_motor.csv has {record.n}; "
                          "the two files are of different runs")
    goal, early = hold_last(control.time, control.q, record.time)
    notes = [f"qd is the goal in {path.name} in force at the stamp of each state.",
             *(note for note in control.decisions if note not in record.decisions)]
    if early:
        notes.append(f"The first {early} states have no goal yet and are masked.")
    valid = record.valid & np.isfinite(goal).all(axis=1)
    return record.replace(qd=read_only(goal), valid=valid).noted(*notes)


def _joint_names(path: Path, n: int) -> tuple[str, ...]:
    if not path.is_file():
        return ()
    lines = path.read_text(errors="replace").splitlines()
    names = tuple(line.strip() for line in lines if line.strip())
    if len(names) != n:
        raise RecordError(f"{path} lists {len(names)} joints, the log has {n}; correct the list")
    return names
