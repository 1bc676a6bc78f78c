"""The logs in the folder of a robot: which files, in which order, and what is left out."""

import dataclasses
import os
import re
from collections.abc import Sequence
from pathlib import Path

from clie_blocks.analysis.records.readers.formats import FOLDERS
from clie_blocks.errors import RecordError

ROBOT = "robot.toml"
TABLES = (".csv", ".csv.gz", ".tsv", ".tsv.gz", ".parquet", ".npz", ".mat", ".mcap", ".db3")
NUMBERED = re.compile(r"log[-_ ]?\d+\..+", re.I)
LEFT_OUT = (  # names of tables that are no logs of the robot
    (re.compile(r".*\.next\.csv", re.I), "set-points of a next run"),
    (re.compile(r"sim(ulat(ed|ion|or))?[-_ .\d].*", re.I), "of a simulator, by its name"),
)


@dataclasses.dataclass(frozen=True)
class Contents:
    """What a folder holds.

    Parameters
    ----------
    logs : tuple of Path
        In natural order, ``run-2`` before ``run-10``.
    left_out : tuple of str
        Names of tables that are not read, each with the reason.
    data_set : bool
        Whether the folder as a whole is a log or a data set of a known format.

    """

    logs: tuple[Path, ...]
    left_out: tuple[str, ...] = ()
    data_set: bool = False

    def notes(self) -> list[str]:
        """What was left out, as a sentence."""
        return [f"Not read: {', '.join(self.left_out)}."] if self.left_out else []


def contents(folder: str | os.PathLike[str]) -> Contents:
    """Return the logs of a folder: those called ``log-N``, else all tables, and ROS 2 bags.

    Raises
    ------
    RecordError
        If the folder cannot be looked into.

    """
    folder = Path(folder)
    try:
        entries = sorted((path for path in folder.iterdir() if not path.name.startswith(".")),
                         key=_natural)
    except OSError as error:
        raise RecordError(f"cannot look into {folder}: {error.strerror}; name a log, or a folder "
                          "with robot.toml and logs") from None
    tables = [path for path in entries if _is_log(path)]
    numbered = [path for path in tables if NUMBERED.fullmatch(path.name)]
    if not numbered and is_data_set(folder):
        return Contents((), data_set=True)
    reasons = {path: _reason(path, tables[:k], bool(numbered)) for k, path in enumerate(tables)}
    return Contents(tuple(path for path in tables if not reasons[path]),
                    tuple(f"{path.name} ({reason})" for path, reason in reasons.items() if reason))


def is_data_set(folder: Path) -> bool:
    """Whether a folder as a whole is of a known format, such as a bag or a LeRobot data set."""
    return any(all((folder / entry).is_file() for entry in wanted) for _, wanted in FOLDERS)


def is_bag(path: Path) -> bool:
    """Whether a path is a ROS 2 bag: one log that is a folder."""
    return (path / "metadata.yaml").is_file()


def nothing_to_read(folder: Path) -> RecordError:
    """Return the error for a folder without logs; it says what there is instead."""
    names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    inner = [name for name in names if (folder / name).is_dir()]
    holds = f"holds {', '.join(names[:6])}{', ...' if len(names) > 6 else ''}" if names else (
        "is empty")
    fix = f"name one of its folders, as {folder / inner[0]}" if inner else (
        f"put logs beside {ROBOT}, with one of the endings {', '.join(TABLES)}")
    return RecordError(f"{folder} {holds}, but no log; {fix}")


def _is_log(path: Path) -> bool:
    return is_bag(path) if path.is_dir() else path.name.lower().endswith(TABLES)


def _reason(path: Path, before: Sequence[Path], numbered: bool) -> str:
    """Why a table is no log of the robot; empty if it is one."""
    for pattern, reason in LEFT_OUT:
        if pattern.fullmatch(path.name):
            return reason
    if numbered and not NUMBERED.fullmatch(path.name):
        return "not called log-N, as others here are"
    twin = next((other for other in before if _stem(other) == _stem(path)), None)
    return "" if twin is None else f"the same log as {twin.name}, by its name"


def _stem(path: Path) -> str:
    """Name of a table without its ending."""
    ending = next((ending for ending in TABLES[::-1] if path.name.lower().endswith(ending)), "")
    return path.name.lower().removesuffix(ending)


def _natural(path: Path) -> tuple[tuple[int, str], ...]:
    """Key that sorts numbers in names by size."""
    parts = re.split(r"(\d+)", path.name.lower())
    return tuple((int(part) if part.isdecimal() else -1, part) for part in parts)
