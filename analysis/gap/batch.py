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
from clie_blocks.analysis.gap.tasks import Task, find_tasks
from clie_blocks.analysis.records.reading import Reading
from clie_blocks.errors import ClieError, MissingExtraError, RecordError
from clie_blocks.output import progress, report_stage, to_json

if TYPE_CHECKING:
    from clie_blocks.analysis.gap.diagnosis import Diagnosis
    from clie_blocks.analysis.gap.problem.locked_output import LockedError
    from clie_blocks.analysis.gap.problem.problem import Problem
    from clie_blocks.analysis.records import Record, Robot

BUDGET = 120.0  # s, of the diagnosis of one robot
PARTS = ".parts"  # ending of a folder that only stores results for a later run, without reports


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
    reading : Reading
        How the logs are read: columns, unit of the clock, topics.
    trust_logs : bool
        Correct nothing in the logs, and stop for nothing that a check finds in them.
    seconds : float
        Budget of the diagnosis of one robot [s].
    library : tuple of str
        Python files with effects of the user's own.
    run_law : bool
        Run the control law that a robot file names, where it is a Python file.
    by_log : bool
        The answers also hold the parameters from each log alone.

    """

    holdout: str | None = None
    effects: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    simulated: tuple[str, ...] = ()
    reading: Reading = Reading()
    trust_logs: bool = False
    seconds: float = BUDGET
    library: tuple[str, ...] = ()
    run_law: bool = False
    by_log: bool = False


def _diagnose(task: Task, options: Options) -> Diagnosis:
    from clie_blocks.analysis.gap.diagnosis import diagnose
    from clie_blocks.analysis.gap.stages import STAGES, with_titles

    if options.library:
        from clie_blocks.effects import register_file

        for file in options.library:
            register_file(file)
    report_stage("reading the logs")
    return diagnose(state(task, options), effects=options.effects, exclude=options.exclude,
                    seconds=options.seconds, stages=with_titles(STAGES))


def read(*paths: str | os.PathLike[str], robot: str | os.PathLike[str] | None = None,
         trust_logs: bool = False, run_law: bool = False) -> Problem:
    """State the problem of a folder with ``robot.toml`` and logs, or of log files of one robot.

    Parameters
    ----------
    *paths : path-like
        A folder, or log files.
    robot : path-like, optional
        Robot file of log files.
    trust_logs : bool
        Correct nothing in the logs, and stop for nothing that a check finds in them.
    run_law : bool
        Run the control law that the robot file names, where it is a Python file.

    Raises
    ------
    RecordError
        If a path holds nothing that can be diagnosed, the paths are of several robots, or the
        logs are not what they seem to be.

    """
    tasks = find_tasks(paths, robot)
    if len(tasks) != 1:
        raise RecordError(f"{', '.join(map(str, paths))}: {len(tasks)} robots, and a problem is "
                          f"of one; name one of {', '.join(task.name for task in tasks)}")
    return state(tasks[0], Options(trust_logs=trust_logs, run_law=run_law))


def state(task: Task, options: Options = Options()) -> Problem:
    """Problem of a task, with the hold-out log and the simulator's logs that the user named."""
    from clie_blocks.analysis.gap.problem.problem import Problem

    robot, records = read_task(task, options.reading)
    if options.run_law:
        from clie_blocks.analysis.records.law_file import with_law_of_file

        robot = with_law_of_file(robot)
    held_out = _held_out(options.holdout, records)
    problem = Problem.from_logs(robot, records, held_out, options.trust_logs)
    if not options.simulated:
        return problem
    from clie_blocks.analysis.records.read import read_logs

    return problem.beside(read_logs(options.simulated, robot, **options.reading.keywords()))


def read_task(task: Task, reading: Reading) -> tuple[Robot, list[Record]]:
    """Read the robot file and the logs of a task."""
    from clie_blocks.analysis.records import read_robot, read_trial
    from clie_blocks.analysis.records.read import no_robot, read_logs

    if len(task.paths) == 1 and Path(task.paths[0]).is_dir() and task.robot is None:
        return read_trial(task.paths[0], **reading.keywords())
    stated = None if task.robot is None else read_robot(task.robot)
    records = read_logs(task.paths, stated, **reading.keywords())
    robot = stated or records[0].robot
    if robot is None:
        raise no_robot(Path(task.paths[0]), records)
    return robot, records


def _held_out(holdout: str | None, records: Sequence[Record]) -> list[int] | None:
    """Position of the log that the user named: by file name, by its beginning, or by number."""
    if holdout is None:
        return None
    names = [Path(record.source).name for record in records]
    wanted = Path(holdout).name
    named = [k for k, name in enumerate(names) if wanted in (name, name.partition(".")[0])]
    found = named or [k for k in range(len(names)) if wanted == str(k + 1)]
    if len(found) != 1:
        reason = "several logs are called so" if found else "no such log"
        numbered = ", ".join(f"{k} ({name})" for k, name in enumerate(names, 1))
        raise RecordError(f"--holdout {holdout}: {reason}; give the number of one of {numbered}")
    if len(records) == 1:
        raise RecordError(f"--holdout {holdout}: it is the only log, and nothing would be left to "
                          "fit a model to; leave out --holdout, or add a log")
    return found


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
            with progress(f"diagnosing {task.name}"):
                answer = _finish(task, options, folder)
            yield task.name, answer
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
    from clie_blocks.analysis.gap.problem.locked_output import LockedError
    from clie_blocks.analysis.gap.report.answer import answer, by_log
    from clie_blocks.analysis.gap.report.files import write_answer, write_report

    try:
        diagnosis = _diagnose(task, options)
    except LockedError as locked:
        return _locked(locked, task, options, folder)
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    result = answer(diagnosis)
    if options.by_log:
        result["by_log"] = by_log(diagnosis)
    if folder is None:
        return json.loads(to_json(result))
    result = {"made_from": digest_of_inputs(task, options), **result}
    if Path(folder).suffix == PARTS:
        write_answer(result, folder, task.name)
    else:
        write_report(diagnosis, result, folder, task.name)
    return _read_stored(task, folder)


def _locked(locked: LockedError, task: Task, options: Options,
            folder: str | os.PathLike[str] | None) -> dict[str, Any]:
    """Result of a robot whose output was locked in all logs: the twist of its gears."""
    from clie_blocks.analysis.gap.problem.locked_output import LOCKED
    from clie_blocks.analysis.gap.report.answer import SCHEMA_VERSION
    from clie_blocks.analysis.gap.report.files import write_answer

    result = {"schema_version": SCHEMA_VERSION, "verdict": LOCKED,
              "locked": [twist.to_dict() for twist in locked.twists]}
    if folder is not None:
        write_answer({"made_from": digest_of_inputs(task, options), **result}, folder, task.name)
    return result


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
    for path in map(Path, (*task.paths, *([task.robot] if task.robot else []),
                           *options.simulated, *options.library)):
        for file in sorted(path.rglob("*")) if path.is_dir() else _with_robot_file(path):
            if file.is_file() and not file.name.startswith("."):
                digest.update(str(file.relative_to(path.parent)).encode())
                digest.update(_digest_of_file(file))
    return digest.hexdigest()


def _with_robot_file(log: Path) -> list[Path]:
    """A log, and next to it the robot file, and programs that it may name."""
    return [log, log.parent / "robot.toml", *sorted(log.parent.glob("*.py"))]


def _digest_of_file(file: Path) -> bytes:
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").digest()


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
