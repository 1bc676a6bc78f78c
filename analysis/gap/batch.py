"""Many trials: found in folders, diagnosed side by side, each result kept on disk at once.

A killed run continues where it stopped: a result is read back if logs, robot file, options and
version are the ones it was made from.
"""

import contextlib
import dataclasses
import hashlib
import json
from pathlib import Path

from clie_blocks import __version__
from clie_blocks.errors import ClieError, MissingExtraError, RecordError
from clie_blocks.output import progress, to_json, write

PARTS = ".parts"  # ending of a folder that only keeps results for a later run, without reports


@dataclasses.dataclass(frozen=True)
class Task:
    """One robot and its logs, as paths.

    Parameters
    ----------
    name : str
        Name in the results.
    paths : tuple of str
        A folder with ``robot.toml``, or log files.
    robot : str or None
        Robot file, where it is not in the folder.

    """

    name: str
    paths: tuple
    robot: str | None = None


@dataclasses.dataclass(frozen=True)
class Options:
    """What a user may choose.

    Parameters
    ----------
    holdout : str or None
        Log that only judges, by name or number; by default the last.
    effects, exclude : tuple of str
        Effects to look for (all when empty), and effects to leave out.
    report : bool
        Write a page beside each result that is kept.
    simulated : tuple of str
        Logs of the user's own simulator in the same experiments.

    """

    holdout: str | None = None
    effects: tuple = ()
    exclude: tuple = ()
    report: bool = False
    simulated: tuple = ()


def find_tasks(paths, robot=None):
    """Return the trials that some paths name.

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
    paths = [Path(path) for path in paths]
    for path in paths:
        if not path.exists():
            raise RecordError(f"{path} does not exist; give a log, or a folder with robot.toml "
                              "and logs")
    if all(path.is_file() for path in paths):
        return [Task(paths[0].stem.partition(".")[0], tuple(map(str, paths)),
                      None if robot is None else str(robot))]
    found = []
    for path in paths:
        inside = [path] if (path / "robot.toml").is_file() or robot else sorted(
            folder for folder in path.iterdir() if (folder / "robot.toml").is_file())
        found += [Task(folder.name, (str(folder),), None if robot is None else str(robot))
                  for folder in inside or [path]]
    return found


def diagnose_trial(trial, options=None):
    """Diagnose one trial and return its JSON object.

    Parameters
    ----------
    trial : Trial
        Where it is.
    options : Options, optional
        The user's choices.

    """
    from clie_blocks.analysis.gap.report.answer import answer

    return json.loads(to_json(answer(*_diagnose(trial, options or Options()))))


def _diagnose(trial, options):
    from clie_blocks.analysis.gap.diagnosis import diagnose

    robot, records, simulated = read_with_simulated(trial, options.simulated)
    held_out = _held_out(options.holdout, records, trial.paths)
    return diagnose(robot, records, held_out=held_out, effects=options.effects,
                    exclude=options.exclude, simulated=simulated), records


def read(trial):
    """Robot and records of a trial, in the form of eq. (11)."""
    return read_with_simulated(trial, ())[:2]


def read_with_simulated(trial, simulated):
    """Robot, records and logs of a simulator, in the form of eq. (11)."""
    from clie_blocks.analysis.gap.problem.preparation import prepare
    from clie_blocks.analysis.gap.simulator_comparison.logs import complete
    from clie_blocks.analysis.records import read_record

    robot, records = _read_logs(trial)
    also = [complete(read_record(path, robot), j, records) for j, path in enumerate(simulated)]
    robot, every = prepare(robot, [*records, *also])
    return robot, every[:len(records)], every[len(records):]


def _read_logs(trial):
    from clie_blocks.analysis.records import read_record, read_robot, read_trial

    if len(trial.paths) == 1 and Path(trial.paths[0]).is_dir() and trial.robot is None:
        return read_trial(trial.paths[0])
    if trial.robot is None:
        raise RecordError(f"{trial.paths[0]}: no robot file; give --robot robot.toml with what is "
                          "known of robot and controller")
    robot = read_robot(trial.robot)
    return robot, [read_record(path, robot) for path in trial.paths]


def _held_out(holdout, records, paths):
    if holdout is None:
        return None
    names = [str(Path(record.source).name) for record in records]
    for k, name in enumerate(names):
        if holdout in (name, name.partition(".")[0], str(k + 1)):
            return [k]
    raise RecordError(f"--holdout {holdout}: no such log; there are {', '.join(names)}")


def diagnose_all(trials, options=None, jobs=1, folder=None, executor=None):
    """Diagnose trials side by side.

    Parameters
    ----------
    trials : list of Trial
        What to diagnose.
    options : Options, optional
        The user's choices.
    jobs : int
        Processes.
    folder : path-like, optional
        Where each result is kept, and found again by a later run.
    executor : concurrent.futures.Executor, optional
        Any PEP 3148 executor in the place of processes.

    Yields
    ------
    name : str
        Of the trial.
    answer : dict
        Its JSON object; ``{"error": text}`` where it could not be diagnosed.

    """
    options = options or Options()
    waiting = []
    for trial in trials:
        kept = _stored(trial, options, folder)
        if kept is None:
            waiting.append(trial)
        else:
            yield trial.name, kept
    if jobs == 1 and executor is None:
        for trial in waiting:
            yield trial.name, _finish(trial, options, folder)
        return
    yield from _spread(waiting, options, jobs, folder, executor)


def _spread(waiting, options, jobs, folder, executor):
    from concurrent.futures import as_completed
    from concurrent.futures.process import BrokenProcessPool

    from clie_blocks.analysis.workers import workers

    pool = executor or workers(jobs)
    try:
        running = {pool.submit(_finish, trial, options, folder): trial for trial in waiting}
        with progress("diagnosing", len(waiting)) as advance:
            for future in as_completed(running):
                yield running[future].name, future.result()
                advance(1)
    except BrokenProcessPool:
        raise ClieError(f"one of {jobs} processes was killed, maybe for lack of memory; what is "
                        "done is kept: run the same command again, with fewer --jobs") from None
    finally:
        if executor is None:
            pool.shutdown(wait=True, cancel_futures=True)


def _finish(trial, options, folder):
    from clie_blocks.analysis.gap.report.answer import answer

    try:
        diagnosis, records = _diagnose(trial, options)
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    found = json.loads(to_json(answer(diagnosis, records)))
    if folder is not None:
        from clie_blocks.analysis.gap.report import write_report

        if Path(folder).suffix != PARTS:
            files = write_report(diagnosis, records, folder, trial.name)
            if any(file.endswith(".next.csv") for file in files):
                found["next_experiment"]["set_points"] = f"{trial.name}.next.csv"
        write(_place(trial, folder), to_json({"made_from": digest_of_inputs(trial, options), **found}))
    return found


def _place(trial, folder):
    return Path(folder) / f"{trial.name}.json"


def _stored(trial, options, folder):
    if folder is None or not _place(trial, folder).is_file():
        return None
    try:
        kept = json.loads(_place(trial, folder).read_text())
    except (OSError, ValueError):
        return None
    return kept if kept.pop("made_from", None) == digest_of_inputs(trial, options) else None


def digest_of_inputs(trial, options):
    """Digest of everything that a result depends on."""
    digest = hashlib.sha256(f"{__version__} {options}".encode())
    files = [Path(path) for path in (*trial.paths, *([trial.robot] if trial.robot else []),
                                     *options.simulated)]
    for path in files:
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            if file.is_file():
                digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def cluster(address):
    """Executor of a Dask cluster, closed at the end.

    Parameters
    ----------
    address : str
        Of its scheduler.

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
