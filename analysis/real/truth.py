"""What is known of a machine beside its logs: `truth.toml`, one table per run."""

from __future__ import annotations

import dataclasses
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.gap.causes.vocabulary import effect_names
from clie_blocks.errors import RecordError, nearest

TRUTH, ROBOT = "truth.toml", "robot.toml"
KNOWN_MACHINES = Path(__file__).parent / "machines"
"""A folder per public machine, under the name that its folder of logs has."""


@dataclasses.dataclass(frozen=True)
class Size:
    """Independent value of a parameter.

    Parameters
    ----------
    parameter : str
        ``effect.parameter`` as in an answer, or a quantity of a comparison or of a locked output.
    low, high : float
        Range in which it lies.

    """

    parameter: str
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Run:
    """Logs of a machine that make one diagnosis, and what is true of them.

    Parameters
    ----------
    name : str
        What was run.
    logs : tuple of str
        Parts of the names of the logs, in their order; the last one is held out.
    unloaded : tuple of str
        Logs of the same machine without its load: then the two are compared.
    joints : tuple of str
        Joints that are diagnosed; all when empty.
    robot : str
        Robot file beside the truth; of a reader that describes its machine, empty.
    cause : tuple of str
        Names of one class: the effect that costs most is one of them.
    joint : tuple of str
        Joints at which it acts; not known when empty.
    also : tuple of str
        Effects that are there besides, and that are not what is asked for.
    absent : tuple of str
        Effects that are not there.
    control : tuple of str
        Joints that have no effect: whatever is attributed to them is false.
    size : tuple of Size
        Independent values.
    exclude : tuple of str
        Effects that are left out of the search, as their user would.
    why : str
        How the truth is known.

    """

    name: str
    logs: tuple[str, ...]
    unloaded: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    robot: str = ""
    cause: tuple[str, ...] = ()
    joint: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
    control: tuple[str, ...] = ()
    size: tuple[Size, ...] = ()
    exclude: tuple[str, ...] = ()
    why: str = ""


@dataclasses.dataclass(frozen=True)
class Machine:
    """A machine with its runs.

    Parameters
    ----------
    name, source : str
        What it is, and where its logs come from.
    logs, truth : Path
        Folder of the logs, and folder of the truth and of the robot files.
    runs : tuple of Run
        What was run on it.

    """

    name: str
    source: str
    logs: Path
    truth: Path
    runs: tuple[Run, ...]


def machines_of(folder: str | os.PathLike[str]) -> list[Machine]:
    """Machines of a data folder: its subfolders with a `truth.toml`, and the public machines.

    Raises
    ------
    RecordError
        If there is none, or a truth is faulty.

    """
    folder = Path(folder)
    if not folder.is_dir():
        raise RecordError(f"{folder} is not a folder; name the folder that holds one folder of "
                          "logs per machine")
    found = [_machine(logs, truth) for logs, truth in _folders(folder)]
    if not found:
        raise RecordError(f"{folder}: no machine with a known truth; put a {TRUTH} beside the "
                          "logs of each machine (docs/real_machines.md says what it holds), or "
                          f"name a folder with one of {', '.join(_known())}")
    return found


def _folders(folder: Path) -> Iterator[tuple[Path, Path]]:
    for logs in sorted(path for path in (folder, *folder.iterdir()) if path.is_dir()):
        if (logs / TRUTH).is_file():
            yield logs, logs
        elif logs.name in _known():
            yield logs, KNOWN_MACHINES / logs.name


def _known() -> list[str]:
    return sorted(path.name for path in KNOWN_MACHINES.iterdir() if (path / TRUTH).is_file())


def _machine(logs: Path, truth: Path) -> Machine:
    path = truth / TRUTH
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RecordError(f"{path}: {error}; it must be TOML in UTF-8") from None
    _refuse_unknown(table, ("machine", "source", "run"), str(path))
    runs = table.get("run", [])
    if not isinstance(runs, list) or not runs or not all(isinstance(one, dict) for one in runs):
        raise RecordError(f"{path}: no [[run]]; write one for each set of logs, with logs = [..] "
                          "and cause = [..]")
    return Machine(str(table.get("machine", logs.name)), str(table.get("source", "")), logs, truth,
                   tuple(_run(one, f"{path}: run {i + 1}") for i, one in enumerate(runs)))


def _run(table: Mapping[str, Any], where: str) -> Run:
    fields = {field.name: field for field in dataclasses.fields(Run)}
    _refuse_unknown(table, fields, where)
    values: dict[str, Any] = {
        key: (str(value) if fields[key].type == "str" else _texts(value, f"{where}: {key}"))
        for key, value in table.items() if key != "size"}
    if not values.get("name") or not values.get("logs"):
        raise RecordError(f"{where}: it needs a name and logs = [..], parts of the names of its "
                          "logs")
    for key in ("cause", "also", "absent", "exclude"):
        for name in values.get(key, ()):
            if name not in effect_names():
                raise RecordError(f"{where}: {key}: no effect {name!r}; "
                                  f"{nearest(name, effect_names())}")
    return Run(**values, size=_sizes(table.get("size", {}), where))


def _texts(value: Any, where: str) -> tuple[str, ...]:
    if isinstance(value, list) and all(isinstance(one, str) for one in value):
        return tuple(value)
    raise RecordError(f"{where} must be a list of texts, got {value!r}")


def _sizes(table: Any, where: str) -> tuple[Size, ...]:
    if not isinstance(table, dict):
        raise RecordError(f"{where}: size must be a table, size = {{ \"coulomb.level\" = "
                          f"[2.5, 3.1] }}, got {table!r}")
    for key, value in table.items():
        if not (isinstance(value, list) and len(value) == 2 and value[0] <= value[1]):
            raise RecordError(f"{where}: size of {key} must be [low, high], got {value!r}")
    return tuple(Size(key, float(low), float(high)) for key, (low, high) in table.items())


def _refuse_unknown(table: Mapping[str, Any], known: Sequence[str] | Mapping[str, Any],
                    where: str) -> None:
    for key in table:
        if key not in known:
            raise RecordError(f"{where}: no key {key!r}; {nearest(key, known)}")
