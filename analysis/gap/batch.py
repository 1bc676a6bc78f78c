"""Many robots: found in folders, diagnosed side by side, each result stored at once.

A killed run continues where it stopped: a result is read back if logs, robot file, options and
version are those that it was made from.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clie_blocks import __version__
from clie_blocks.errors import ClieError, MissingExtraError, RecordError
from clie_blocks.output import progress, to_json

if TYPE_CHECKING:
    from clie_blocks.analysis.gap.diagnosis import Diagnosis
    from clie_blocks.analysis.gap.problem.problem import Problem
    from clie_blocks.analysis.records import Record, Robot

PARTS = ".parts"  # ending of a folder that only stores results for a later run, without reports


@dataclasses.dataclass(frozen=True)
class Task:
    """One robot and its logs, as paths: a folder with ``robot.toml``, or log files and `robot`."""

    name: str
    paths: tuple[str, ...]
    robot: str | None = None


@dataclasses.dataclass(frozen=True)
class Options:
    """What a user may choose.

    Parameters
    ----------
    holdout : str or None
        Hold-out log, used for validation only, by name or number; by default the last.
    effects, exclude : tuple of str
        Effects to look for (all when empty), and effects to leave out.
    simulated : tuple of str
        Logs of the user's own simulator in the same experiments.

    """

    holdout: str | None = None
    effects: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    simulated: tuple[str, ...] = ()


def find_tasks(paths: Sequence[str | os.PathLike[str]],
               robot: str | os.PathLike[str] | None = None) -> list[Task]:
    """Return the tasks that some paths name.

    Parameters
    ----------
    paths : list of path-like
        Folders with ``robot.toml``, folders of such folders, known data sets, or log files of one
        robot.
    robot : path-like, optional
        Robot file of log files.

    Raises
    ------
    RecordError
        If a path holds nothing that can be diagnosed.

    """
    places = [Path(path) for path in paths]
    robot = None if robot is None else str(robot)
    for path in places:
        if not path.exists():
            raise RecordError(f"{path} does not exist; give a log, or a folder with robot.toml "
                              "and logs")
    if all(path.is_file() for path in places):
        return [Task(places[0].stem.partition(".")[0], tuple(map(str, places)), robot)]
    return [Task(folder.name, (str(folder),), robot)
            for path in places for folder in _robot_folders(path, robot)]


def _robot_folders(path: Path, robot: str | None) -> list[Path]:
    """The folder itself if it holds one robot, otherwise the folders of robots inside it."""
    if robot or (path / "robot.toml").is_file():
        return [path]
    return sorted(folder for folder in path.iterdir()
                  if (folder / "robot.toml").is_file()) or [path]


def _diagnose(task: Task, options: Options) -> Diagnosis:
    from clie_blocks.analysis.gap.diagnosis import diagnose

    return diagnose(state(task, options), effects=options.effects, exclude=options.exclude)


def read(*paths: str | os.PathLike[str], robot: str | os.PathLike[str] | None = None) -> Problem:
    """State the problem of a folder with ``robot.toml`` and logs, or of log files of one robot.

    Parameters
    ----------
    *paths : path-like
        A folder, or log files.
    robot : path-like, optional
        Robot file of log files.

    Raises
    ------
    RecordError
        If a path holds nothing that can be diagnosed, or the paths are of several robots.

    """
    tasks = find_tasks(paths, robot)
    if len(tasks) != 1:
        raise RecordError(f"{', '.join(map(str, paths))}: {len(tasks)} robots, and a problem is "
                          f"of one; name one of {', '.join(task.name for task in tasks)}")
    return state(tasks[0])


def state(task: Task, options: Options = Options()) -> Problem:
    """Problem of a task, with the hold-out log and the simulator's logs that the user named."""
    from clie_blocks.analysis.gap.problem.problem import Problem
    from clie_blocks.analysis.records import read_record

    robot, records = _read_logs(task)
    problem = Problem.from_logs(robot, records, _held_out(options.holdout, records))
    if not options.simulated:
        return problem
    return problem.beside([read_record(path, robot) for path in options.simulated])


def _read_logs(task: Task) -> tuple[Robot, list[Record]]:
    from clie_blocks.analysis.records import read_record, read_robot, read_trial

    if len(task.paths) == 1 and Path(task.paths[0]).is_dir() and task.robot is None:
        return read_trial(task.paths[0])
    if task.robot is None:
        raise RecordError(f"{task.paths[0]}: no robot file; give --robot robot.toml with what is "
                          "known of robot and controller")
    robot = read_robot(task.robot)
    return robot, [read_record(path, robot) for path in task.paths]


def _held_out(holdout: str | None, records: Sequence[Record]) -> list[int] | None:
    if holdout is None:
        return None
    names = [str(Path(record.source).name) for record in records]
    for k, name in enumerate(names):
        if holdout in (name, name.partition(".")[0], str(k + 1)):
            return [k]
    raise RecordError(f"--holdout {holdout}: no such log; there are {', '.join(names)}")


def diagnose_all(tasks: Sequence[Task], options: Options = Options(), jobs: int = 1,
                 folder: str | os.PathLike[str] | None = None,
                 executor: Executor | None = None) -> Iterator[tuple[str, dict[str, Any]]]:
    """Diagnose tasks side by side; yield the name and the JSON object of each.

    Parameters
    ----------
    tasks : list of Task
        What to diagnose.
    options : Options, optional
        The user's choices.
    jobs : int
        Processes.
    folder : path-like, optional
        Where each result is stored with its report, and read back by a later run; a name that
        ends in ``.parts`` stores the results alone.
    executor : concurrent.futures.Executor, optional
        Any PEP 3148 executor instead of processes.

    Yields
    ------
    name : str
        Of the task.
    answer : dict
        Its JSON object; ``{"error": text, "exit_code": int}`` where it could not be diagnosed.

    """
    waiting = []
    for task in tasks:
        stored = _stored(task, options, folder)
        if stored is None:
            waiting.append(task)
        else:
            yield task.name, stored
    if jobs == 1 and executor is None:
        for task in waiting:
            yield task.name, _finish(task, options, folder)
        return
    yield from _spread(waiting, options, jobs, folder, executor)


def _spread(waiting: Sequence[Task], options: Options, jobs: int,
            folder: str | os.PathLike[str] | None, executor: Executor | None
            ) -> Iterator[tuple[str, dict[str, Any]]]:
    from concurrent.futures import as_completed
    from concurrent.futures.process import BrokenProcessPool

    from clie_blocks.analysis.workers import workers

    pool = executor or workers(jobs)
    try:
        running = {pool.submit(_finish, task, options, folder): task for task in waiting}
        with progress("diagnosing", len(waiting)) as advance:
            for future in as_completed(running):
                yield running[future].name, future.result()
                advance(1)
    except BrokenProcessPool:
        raise ClieError(f"one of {jobs} processes was killed, possibly out of memory; finished "
                        "results are saved: run the same command again, with fewer --jobs"
                        ) from None
    finally:
        if executor is None:
            pool.shutdown(wait=True, cancel_futures=True)


def _finish(task: Task, options: Options, folder: str | os.PathLike[str] | None
            ) -> dict[str, Any]:
    """Diagnose a task and store its result; an error of the user becomes the result."""
    from clie_blocks.analysis.gap.report.answer import answer
    from clie_blocks.analysis.gap.report.files import write_answer, write_report

    try:
        diagnosis = _diagnose(task, options)
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    result = answer(diagnosis)
    if folder is None:
        return json.loads(to_json(result))
    result = {"made_from": digest_of_inputs(task, options), **result}
    if Path(folder).suffix == PARTS:
        write_answer(result, folder, task.name)
    else:
        write_report(diagnosis, result, folder, task.name)
    return _read_stored(task, folder)


def _stored(task: Task, options: Options, folder: str | os.PathLike[str] | None
            ) -> dict[str, Any] | None:
    """Result of an earlier run from the same inputs; None where there is none."""
    if folder is None:
        return None
    try:
        return _read_stored(task, folder, digest_of_inputs(task, options))
    except (OSError, ValueError):
        return None


def _read_stored(task: Task, folder: str | os.PathLike[str], digest: str = "") -> dict[str, Any]:
    result = json.loads((Path(folder) / f"{task.name}.json").read_text())
    if result.pop("made_from", None) != digest and digest:
        raise ValueError(f"the result of {task.name} was made from other inputs")
    return result


def digest_of_inputs(task: Task, options: Options) -> str:
    """Digest of everything that a result depends on."""
    digest = hashlib.sha256(f"{__version__} {options}".encode())
    files = [Path(path) for path in (*task.paths, *([task.robot] if task.robot else []),
                                     *options.simulated)]
    for path in files:
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            if file.is_file():
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Executor of the Dask cluster whose scheduler is at an address, closed at the end.

    Raises
    ------
    MissingExtraError
        If Dask is not installed.
    ClieError
        If no scheduler answers.

    """
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("--cluster", "dask[distributed]", "cluster") from None
    try:
        client = Client(address)
    except (OSError, ValueError) as error:
        raise ClieError(f"no Dask scheduler answers at {address} ({error}); start one with 'dask "
                        "scheduler', workers with 'dask worker ADDRESS', or leave out --cluster "
                        "and use --jobs") from None
    with client:
        yield client.get_executor()
