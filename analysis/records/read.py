"""Reading logs: `read_record` for one run, `read_records` for all runs, `read_trial` for a set."""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.records.assemble import assemble
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.formats import reader, recognise
from clie_blocks.analysis.records.readers.options import Options, library_errors
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.analysis.records.table import Table
from clie_blocks.errors import RecordError

LOG = re.compile(r"log-?(\d+)\.(csv|csv\.gz|parquet|npz|mat)")


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
    if path.is_dir() and (path / "robot.toml").is_file():
        logs = _logs(path)
        if logs:
            robot = read_robot(path / "robot.toml") if robot is None else _robot(robot)
            return [record for log in logs for record in read_records(
                log, robot, columns=columns, time_unit=time_unit)]
    name = recognise(path)
    module = reader(name)
    known, notes = _robot_of(robot, path)
    options = Options(known, columns, time_unit, topic, command_topic)
    with library_errors(path, f"a log of the format {name}"):
        return [_finished(log, options, notes) for log in module.read(path, options)]


def read_trial(folder: str | os.PathLike[str]) -> tuple[Robot, list[Record]]:
    """Read a robot and its runs: a folder with `robot.toml` and logs, or a known data set.

    Parameters
    ----------
    folder : path-like
        Holds ``robot.toml`` and ``log-1.csv.gz, log-2.csv.gz, ...``.

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
                          "log-*.csv")
    records = read_records(folder)
    if records[0].robot is None:
        raise RecordError(f"{folder} has logs but no robot.toml, so the robot is not known; write "
                          "one, with joints = N as its first line")
    return records[0].robot, records


def _logs(folder: Path) -> list[Path]:
    found = [(int(match[1]), path) for path in folder.iterdir()
             if (match := LOG.fullmatch(path.name))]
    return [path for _, path in sorted(found)]


def _robot(robot: Robot | str | os.PathLike[str]) -> Robot:
    return robot if isinstance(robot, Robot) else read_robot(robot)


def _robot_of(robot: Robot | str | os.PathLike[str] | None,
              path: Path) -> tuple[Robot | None, list[str]]:
    inside = path / "robot.toml"
    next_to_it = inside if inside.is_file() else path.parent / "robot.toml"
    if robot is None and next_to_it.is_file():
        return (read_robot(next_to_it),
                [f"Took the robot from {next_to_it}, which lies next to the log."])
    return (None if robot is None else _robot(robot)), []


def _finished(log: Table | Record, options: Options, notes: Sequence[str]) -> Record:
    if isinstance(log, Table):
        log = assemble(log, options.robot, options.columns, options.time_unit)
    elif options.robot is not None:
        log = log.of_robot(options.robot)
    return log.noted(*notes) if notes else log
