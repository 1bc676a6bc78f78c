"""Reading logs: `read_record` for one run, `read_records` for all runs, `read_trial` for a set."""

import dataclasses
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.records.assemble import assemble
from clie_blocks.analysis.records.coupled_motors import with_motor_positions
from clie_blocks.analysis.records.folder import ROBOT, contents, nothing_to_read
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.formats import reader, recognise
from clie_blocks.analysis.records.readers.options import Options, library_errors
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.analysis.records.table import Table
from clie_blocks.errors import ClieError, RecordError

TABULAR = ("csv", "parquet", "npz", "mat", "franka", "sage")  # formats with columns to map


def read_record(path: str | os.PathLike[str], robot: Robot | str | os.PathLike[str] | None = None,
                *, part: int | None = None, **options: Any) -> Record:
    """Read the one run that a log holds.

    Parameters
    ----------
    path : path-like
        File or folder, see `read_records`.
    robot : Robot or path-like, optional
        The robot, or its `robot.toml`; by default the `robot.toml` next to the log, if any.
    part : int, optional
        Which run, from 0, of a log with several.
    **options
        As for `read_records`.

    Returns
    -------
    Record
        In SI, with every guess in its `decisions`.

    Raises
    ------
    RecordError
        If the log cannot be read, or holds several runs and `part` is not given.

    """
    records = read_records(path, robot, **options)
    if part is None and len(records) > 1:
        raise RecordError(f"{path} has {len(records)} runs; choose one with part=0 to "
                          f"part={len(records) - 1}, or read all with read_records")
    if not -len(records) <= (part or 0) < len(records):
        raise RecordError(f"{path} has {len(records)} runs, so there is no part={part}; count "
                          "from 0")
    return records[part or 0]


def read_records(path: str | os.PathLike[str], robot: Robot | str | os.PathLike[str] | None = None,
                 *, columns: Mapping[str, str] | None = None, time_unit: str | None = None,
                 topic: str | None = None, command_topic: str | None = None) -> list[Record]:
    """Read all runs of a log or of a folder of logs.

    Parameters
    ----------
    path : path-like
        CSV, Parquet, NPZ, MATLAB, ROS 2 bag, MCAP, a folder of LeRobot, SAGE or a trial; the
        format is recognised by content.
    robot : Robot or path-like, optional
        The robot, or its `robot.toml`; by default the `robot.toml` next to the log, if any.
    columns : mapping, optional
        Signal to column pattern, ``{"q": "actual_pos_{joint}"}``.
    time_unit : str, optional
        Unit of the clock, ``s``, ``ms``, ``us`` or ``ns``.
    topic, command_topic : str, optional
        Of a bag: topic with the joint states, and topic with the commands.

    Returns
    -------
    list of Record
        In SI, each with its robot.

    Raises
    ------
    RecordError
        If the log cannot be read.
    MissingExtraError
        If the format needs a package that is not installed.

    """
    path = Path(path)
    stated = Options(None, columns, time_unit, topic, command_topic)
    if not path.is_dir():
        return _read(path, robot, stated)
    found = contents(path)
    if found.data_set:
        return _read(path, robot, stated)
    if not found.logs:
        raise nothing_to_read(path)
    if robot is not None or (path / ROBOT).is_file():
        robot = _robot(path / ROBOT if robot is None else robot)
    records = [record for log in found.logs for record in _read(log, robot, stated)]
    return [records[0].noted(*found.notes()), *records[1:]]


def _read(path: Path, robot: Robot | str | os.PathLike[str] | None,
          stated: Options) -> list[Record]:
    """Runs of one log, or of a folder that is one."""
    if path.suffix.lower() == ".toml":
        raise RecordError(f"{path} describes a robot and is no log; name the log, and the robot "
                          f"with --robot {path}, or the folder {path.parent} with both")
    name = recognise(path)
    _refuse_unused(path, name, stated)
    known, notes = _robot_of(robot, path)
    options = dataclasses.replace(stated, robot=known)
    with library_errors(path, f"a log of the format {name}"):
        return [_finished(log, options, notes) for log in reader(name).read(path, options)]


def _refuse_unused(path: Path, name: str, stated: Options) -> None:
    """Refuse what the user stated and the format of the log has no use for."""
    if stated.columns and name not in TABULAR:
        raise RecordError(f"{path} is of the format {name}, whose signals are fixed: leave out "
                          f"{', '.join(f'--map {signal}=...' for signal in stated.columns)}")
    for option, value in (("--topic", stated.topic), ("--command-topic", stated.command_topic)):
        if value is not None and name != "bag":
            raise RecordError(f"{path} is of the format {name}, and topics are of ROS bags: leave "
                              f"out {option}; the columns of a table are named with --map")


def read_logs(paths: Iterable[str | os.PathLike[str]],
              robot: Robot | str | os.PathLike[str] | None = None, **options: Any) -> list[Record]:
    """Read all runs of several paths, and refuse a run that is named twice.

    Arguments as for `read_records`.
    """
    records = [record for path in paths for record in read_records(path, robot, **options)]
    refuse_twins(records)
    return records


def refuse_twins(records: Sequence[Record]) -> None:
    """Refuse a log that is named twice: it would count twice, and predict itself."""
    seen: set[str] = set()
    for record in records:
        source = os.path.realpath(record.source)
        if source in seen:
            raise ClieError(f"{record.source} is named twice, by itself or in its folder; a log "
                            "counts once: name it once")
        seen.add(source)


def read_trial(folder: str | os.PathLike[str],
               **options: Any) -> tuple[Robot, list[Record]]:
    """Read a robot and its runs: a folder with `robot.toml` and logs, or a known data set.

    Parameters
    ----------
    folder : path-like
        Holds ``robot.toml`` and logs: ``log-1.csv.gz, log-2.csv.gz, ...``, or else all its tables.
    **options
        As for `read_records`.

    Returns
    -------
    robot : Robot
        The robot; of a data set with several robots that of the first run.
    records : list of Record
        In the order of their numbers.

    Raises
    ------
    RecordError
        If a file is missing or cannot be read.

    """
    folder = Path(folder)
    if not folder.is_dir():
        raise RecordError(f"{folder} is not a folder; a trial is a folder with robot.toml and "
                          "logs")
    records = read_records(folder, **options)
    if records[0].robot is None:
        raise no_robot(folder, records)
    return records[0].robot, records


def no_robot(path: Path, records: Sequence[Record]) -> RecordError:
    """Return the error for logs of a robot that is not described."""
    folder = path if path.is_dir() else path.parent
    return RecordError(f"{path}: the robot is not described; write what is known of robot and "
                       f"controller into {folder / ROBOT}, with 'joints = {records[0].n}' as its "
                       "first line, or name such a file with --robot FILE")


def _robot(robot: Robot | str | os.PathLike[str]) -> Robot:
    return robot if isinstance(robot, Robot) else read_robot(robot)


def _robot_of(robot: Robot | str | os.PathLike[str] | None,
              path: Path) -> tuple[Robot | None, list[str]]:
    inside = path / ROBOT
    next_to_it = inside if inside.is_file() else path.parent / ROBOT
    if robot is None and next_to_it.is_file():
        return (read_robot(next_to_it),
                [f"Took the robot from {next_to_it}, which lies next to the log."])
    return (None if robot is None else _robot(robot)), []


def _finished(log: Table | Record, options: Options, notes: Sequence[str]) -> Record:
    if isinstance(log, Table):
        log = assemble(log, options.robot, options.columns, options.time_unit)
    elif options.robot is not None:
        log = log.of_robot(options.robot)
    log = with_motor_positions(log, options.robot)
    return log.noted(*notes) if notes else log
