"""Reading `robot.toml`; what is wrong is named with field, file and line."""

import contextlib
import dataclasses
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.coupled_motors import with_motor_experiments
from clie_blocks.analysis.records.fields import check_value, per_joint
from clie_blocks.analysis.records.model import DEFAULT_UNITS
from clie_blocks.analysis.records.plain_file import check_plain_file
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import (
    Encoder,
    Experiment,
    Limits,
    Links,
    Motor,
    Nominal,
)
from clie_blocks.errors import ClieError, RecordError, nearest
from clie_blocks.rigid_body.model_file import joint_names, read_model
from clie_blocks.rigid_body.tree import Tree

SECTIONS = {"motor": Motor, "links": Links, "nominal": Nominal, "controller": Controller,
            "encoder": Encoder, "limits": Limits}
TABLES = ("experiment", "units", "columns")
TOP = ("name", "joints", "joint_names", *SECTIONS, *TABLES)
LARGEST_INTEGER = 2**63
DEEPEST = 8  # levels of lists and tables; a robot file needs four
DOTS = re.compile(r"(?<!\d)\.|\.(?!\d)|\.\d+\.")  # all but the point of a number
MOST_DOTS = 2000  # of sections, keys and sentences, for which the parser takes 0.2 s
LARGEST_FILE = 1_000_000


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """Read a `robot.toml`.

    Parameters
    ----------
    path : path-like
        The file; its keys are those of the fields of `Robot` and its sections, with units.

    Returns
    -------
    Robot
        What is known of the robot.

    Raises
    ------
    RecordError
        If the file cannot be read, has an unknown key, or a value of the wrong kind; it names
        every line that is wrong.

    """
    path = Path(path)
    return with_motor_experiments(_robot(_RobotFile(path, _text(path))))


def _text(path: Path) -> str:
    try:
        check_plain_file(path)
        if path.stat().st_size > LARGEST_FILE:
            raise RecordError(f"{path} is larger than {LARGEST_FILE} bytes; a robot file has a "
                              "few thousand: point at robot.toml, not at a log")
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise RecordError(f"cannot read robot file {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise RecordError(f"{path} is not text in UTF-8; save the robot file as UTF-8") from None


class _RobotFile:
    """The parsed text, and where each key stands."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.text = text
        self.faults: list[str] = []  # one per line that is wrong
        self._refuse_long_keys()
        try:
            self.table = tomllib.loads(text)
        except RecursionError:
            raise self._too_deep() from None
        except tomllib.TOMLDecodeError as error:
            raise RecordError(f"{path} is not valid TOML: {error}") from None
        except ValueError:  # of an integer of thousands of digits
            raise self._too_large() from None
        self._refuse_strange(self.table, DEEPEST)
        self.lines = _lines(text)

    @contextlib.contextmanager
    def noting(self) -> Iterator[None]:
        """Keep a fault, so that those of the lines below are found as well."""
        try:
            yield
        except RecordError as error:
            self.faults.append(str(error))

    def refuse_faults(self) -> None:
        """Raise all faults as one, in the order of their lines."""
        if self.faults:
            raise RecordError("\n".join(sorted(self.faults, key=_line_of)))

    def _refuse_long_keys(self) -> None:
        """Refuse ``a.a.a. ...``, for which a parser of TOML takes hours."""
        if len(DOTS.findall(self.text)) > MOST_DOTS:
            raise self._too_deep()

    def _refuse_strange(self, value: Any, depth: int) -> None:
        """Refuse depths that no robot needs, and integers that Python refuses to print."""
        if isinstance(value, (dict, list)):
            if depth == 0:
                raise self._too_deep()
            for item in value.values() if isinstance(value, dict) else value:
                self._refuse_strange(item, depth - 1)
        elif isinstance(value, int) and not -LARGEST_INTEGER <= value < LARGEST_INTEGER:
            raise self._too_large()

    def _too_large(self) -> RecordError:
        return RecordError(f"{self.path} has an integer of more than 64 bits, which TOML does not "
                           "have; write a large number as 1e30")

    def _too_deep(self) -> RecordError:
        return RecordError(f"{self.path} is not valid: its keys, lists or tables are nested more "
                           f"than {DEEPEST} deep; write [section] and key = value below it")

    def where(self, *keys: str) -> str:
        """Place of a key: file, line, section, key."""
        section, key = ".".join(keys[:-1]), keys[-1]
        shown = f"[{section}] {key}" if section else key
        line = self.lines.get(".".join(keys)) or self.lines.get(key, 1)
        return f"{self.path}:{line}: {shown}"


def _line_of(fault: str) -> int:
    """Line that a fault names."""
    found = re.search(r":(\d+): ", fault)
    return int(found[1]) if found else 0


def _lines(text: str) -> dict[str, int]:
    """Line on which each ``section`` and each ``section.key`` stands first."""
    found: dict[str, int] = {}
    section = ""
    for number, line in enumerate(text.splitlines(), 1):
        header = re.match(r"\s*\[+([^\]]*)\]", line)
        if header:
            section = re.sub(r"[\"'\s]", "", header[1])
            found.setdefault(section, number)
            continue
        key, equals, _ = line.partition("=")
        if equals:
            key = key.strip().strip("\"'")
            found.setdefault(f"{section}.{key}" if section else key, number)
    return found


def _robot(file: _RobotFile) -> Robot:
    _refuse_unknown(file, (), file.table, TOP)
    n = _count(file)
    experiments, joints = _table(file, "experiment"), _names(file, n)
    sections = {name: _section(file, (name,), _table(file, name), kind, n)
                for name, kind in SECTIONS.items()}
    experiments = {name: _section(file, ("experiment", name), _entry(file, name), Experiment, n)
                   for name in experiments}
    units, columns = (_words(file, name, DEFAULT_UNITS) for name in ("units", "columns"))
    file.refuse_faults()
    links = _tree(file, sections["links"], joints)
    return Robot(
        n=n, name=str(file.table.get("name", "")),
        joints=joints or (links.names if links is not None and links.n == n else ()),
        tree=links, **sections, experiments=experiments, units=units, columns=columns,
        source=str(file.path))


def _tree(file: _RobotFile, links: Links, joints: Sequence[str]) -> Tree | None:
    """Links of the model that the file names."""
    if links.model is None:
        return None
    path = file.path.parent / links.model
    listed: Sequence[str] = links.model_joints or ()
    try:
        if not listed and joints and set(joints) <= set(joint_names(path)):
            listed = joints
        return read_model(path, links.base, links.tip, links.locked, joints=listed,
                          sign=links.sign, zero=links.zero, gravity=links.gravity,
                          payload=links.payload or 0.0)
    except ClieError as error:
        raise RecordError(f"{file.where('links', 'model')}: {error}") from None


def _count(file: _RobotFile) -> int:
    n = file.table.get("joints")
    if n is None:
        file.faults.append(f"{file.path}:1: 'joints' is missing; write the number of joints, "
                           "joints = 2")
        file.refuse_faults()
    if not isinstance(n, int) or isinstance(n, bool) or not 1 <= n <= 1000:
        raise RecordError(f"{file.where('joints')} must be the number of joints, got {n!r}")
    return n


def _names(file: _RobotFile, n: int) -> tuple[str, ...]:
    names = file.table.get("joint_names", ())
    good = isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names)
    if not good or (names and len(set(names)) != n):
        raise RecordError(f"{file.where('joint_names')} must list {n} different names, one per "
                          f"joint, got {names!r}")
    return tuple(names)


def _table(file: _RobotFile, name: str) -> dict[str, Any]:
    table = file.table.get(name, {})
    if not isinstance(table, dict):
        raise RecordError(f"{file.where(name)} must be a section [{name}], got {table!r}")
    return table


def _entry(file: _RobotFile, name: str) -> dict[str, Any]:
    entry = file.table["experiment"][name]
    if not isinstance(entry, dict):
        raise RecordError(f"{file.where('experiment', name)} must be a section "
                          f"[experiment.{name}], named after the log's file")
    return entry


def _section(file: _RobotFile, keys: tuple[str, ...], table: Mapping[str, Any], kind: type,
             n: int) -> Any:
    known = {key: field for field in dataclasses.fields(kind) for key in field.metadata["keys"]}
    faults = len(file.faults)
    _refuse_unknown(file, keys, table, known)
    values = {}
    for key in table.keys() & known.keys():
        with file.noting():
            values[known[key].name] = _value(table[key], known[key], file.where(*keys, key), n)
    if len(file.faults) > faults:  # keys that are missing now may only be misspelt
        return None
    with file.noting():
        try:
            return kind(**values)
        except RecordError as error:
            raise RecordError(f"{file.where(*keys)}: {error}") from None


def _value(value: Any, field: dataclasses.Field[Any], where: str, n: int) -> Any:
    value = check_value(value, field, where)
    return per_joint(value, n, where) if field.metadata["kind"] == "joints" else value


def _refuse_unknown(file: _RobotFile, keys: tuple[str, ...], table: Mapping[str, Any],
                    known: Iterable[str]) -> None:
    known = list(known)
    for key in table:
        if key not in known:
            place = "a key of a robot file" if not keys else f"a key of [{'.'.join(keys)}]"
            file.faults.append(f"{file.where(*keys, key)} is not {place}, and would have no "
                               f"effect; {_elsewhere(key, keys)}{nearest(key, known)}")


def _elsewhere(key: str, keys: tuple[str, ...]) -> str:
    """Where a key belongs that stands in the wrong section."""
    places = [section for section, kind in SECTIONS.items() if section not in keys
              and any(key in field.metadata["keys"] for field in dataclasses.fields(kind))]
    return f"it belongs in [{places[0]}]; " if places else ""


def _words(file: _RobotFile, name: str, known: Iterable[str]) -> dict[str, str]:
    table = _table(file, name)
    _refuse_unknown(file, (name,), table, known)
    for key, value in table.items():
        if not isinstance(value, str):
            file.faults.append(f"{file.where(name, key)} must be text in quotes, got {value!r}")
    return table
