"""The robots that a user asks about, and their logs, found from paths."""

import dataclasses
import os
import shlex
from collections.abc import Sequence
from pathlib import Path

from clie_blocks.analysis.records.folder import ROBOT, contents, is_bag, nothing_to_read
from clie_blocks.errors import ClieError, RecordError, visible


@dataclasses.dataclass(frozen=True)
class Task:
    """One robot and its logs, as paths: a folder with ``robot.toml``, or log files and `robot`."""

    name: str
    paths: tuple[str, ...]
    robot: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", visible(self.name))  # it is printed, and names files


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
    _refuse_places(places)
    logs = [path for path in places if _is_log(path)]
    if not logs:
        folders = [folder for path in places for folder in _robot_folders(path, robot)]
        return [Task(name, (str(folder),), None if robot is None else str(robot))
                for name, folder in zip(_unique_names(folders), folders, strict=True)]
    if len(logs) < len(places):
        folder = next(path for path in places if path not in logs)
        robot = folder / ROBOT if robot is None and (folder / ROBOT).is_file() else robot
        stated = "FILE" if robot is None else _shell(Path(robot))
        raise ClieError(f"{logs[0]} is a log and {folder} a folder, and it is not said whether "
                        f"they are of one robot; name the folder alone: clie diagnose "
                        f"{_shell(folder)}, or logs alone: clie diagnose {_shell(logs[0])} "
                        f"--robot {stated}")
    return [Task(logs[0].name.partition(".")[0] or logs[0].name, tuple(map(str, logs)),
                 _robot_of(logs, robot))]


def _refuse_places(places: Sequence[Path]) -> None:
    """Refuse paths that are missing, named twice, or a robot file."""
    seen: set[Path] = set()
    for path in places:
        if not path.exists():
            raise RecordError(f"{path} does not exist; give a log, or a folder with robot.toml "
                              "and logs")
        if path.suffix.lower() == ".toml" and path.is_file():
            raise RecordError(f"{path} describes a robot and is no log; name its folder: clie "
                              f"diagnose {_shell(path.parent)}, or logs: clie diagnose LOG "
                              f"--robot {_shell(path)}")
        if not path.is_file() and not path.is_dir():
            raise RecordError(f"{path} is neither a file nor a folder; save the log as a file")
        if path.resolve() in seen:
            raise ClieError(f"{path} is named twice, and a log counts once; name it once")
        seen.add(path.resolve())


def _is_log(path: Path) -> bool:
    return path.is_file() or is_bag(path)


def _robot_of(logs: Sequence[Path], robot: str | os.PathLike[str] | None) -> str | None:
    """Robot file of log files: the stated one, else the one in their common folder."""
    if robot is not None:
        return str(robot)
    folders = sorted({path.parent for path in logs})
    beside = [folder / ROBOT for folder in folders if (folder / ROBOT).is_file()]
    if len(folders) > 1 and beside:
        raise ClieError(f"the logs lie in {len(folders)} folders, {_listed(folders)}, and "
                        "are diagnosed as logs of one robot; name the folders to diagnose each, "
                        f"or say which robot it is: --robot {_shell(beside[0])}")
    return str(beside[0]) if beside else None


def _robot_folders(path: Path, robot: str | os.PathLike[str] | None) -> list[Path]:
    """The folder itself if it holds one robot, otherwise the folders of robots inside it."""
    found = contents(path)
    inner = sorted(folder for folder in path.iterdir() if (folder / ROBOT).is_file())
    if (path / ROBOT).is_file() or found.data_set or robot is not None and found.logs:
        if not found.data_set and not found.logs:
            raise nothing_to_read(path)
        return [path]
    if inner and robot is not None:
        raise ClieError(f"--robot {robot} would stand in the place of the robot files of "
                        f"{len(inner)} folders in {path}; leave out --robot, or name one folder, "
                        f"as {inner[0]}")
    if inner:
        return inner
    if found.logs:
        raise RecordError(f"{path} has logs, as {found.logs[0].name}, but no robot.toml; write "
                          f"what is known of robot and controller into {path / ROBOT}, or name "
                          "such a file with --robot FILE")
    raise nothing_to_read(path)


def _unique_names(folders: Sequence[Path]) -> list[str]:
    """Names of folders, with as much of the path before as tells them apart."""
    whole = [[part for part in folder.resolve().parts if part.strip("/\\")] or ["robot"]
             for folder in folders]
    names = [parts[-1] for parts in whole]
    for depth in range(2, max(map(len, whole), default=0) + 1):
        names = [name if names.count(name) == 1 else "-".join(parts[-depth:])
                 for name, parts in zip(names, whole, strict=True)]
    return names


def _listed(paths: Sequence[Path]) -> str:
    return ", ".join(map(str, paths[:3])) + (", ..." if len(paths) > 3 else "")


def _shell(path: Path) -> str:
    """A path as a shell takes it."""
    return shlex.quote(str(path))
