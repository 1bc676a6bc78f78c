"""The files of one robot as an exporter writes them: tables of numbers beside ``robot.toml``."""

import gzip
import re
import shutil
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROBOT = "robot.toml"
DIGITS = 10  # significant digits of a number in a log
Table = dict[str, np.ndarray]  # columns by header, in the order of the file


class DoesNotApplyError(Exception):
    """A damage that these files cannot have; the text says why."""


@dataclass(eq=False)
class Export:
    """What lies in the folder of one robot.

    Parameters
    ----------
    robot : str
        Text of ``robot.toml``.
    logs : dict of str to Table
        By file name.
    clock_digits : int
        Significant digits of the stamps.
    with_noise : callable or None
        ``with_noise(factor)`` logs the same robot again, the noise of its encoders larger by a
        factor; None where nothing but the files is there.

    """

    robot: str
    logs: dict[str, Table]
    clock_digits: int = DIGITS
    with_noise: Callable[[float], "Export"] | None = None

    @classmethod
    def read(cls, folder: Path) -> "Export":
        """Read the robot file and every ``*.csv`` and ``*.csv.gz`` of a folder."""
        files = sorted([*folder.glob("*.csv"), *folder.glob("*.csv.gz")])
        return cls((folder / ROBOT).read_text(), {path.name: _read(path) for path in files})

    def write(self, folder: Path) -> None:
        """Write the files into a folder, which holds nothing else afterwards."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        (folder / ROBOT).write_text(self.robot)
        for name, table in self.logs.items():
            text = _text(table, self.clock_digits).encode()
            packed = gzip.compress(text, 6, mtime=0) if name.endswith(".gz") else text
            (folder / name).write_bytes(packed)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(tomllib.loads(self.robot)["joints"])

    def change(self, signals: Sequence[str],
               law: Callable[[np.ndarray], np.ndarray]) -> None:
        """Put some signals of all logs through a law, each as an array of shape (rows, joints)."""
        for table in self.logs.values():
            for signal in signals:
                names = columns(table, signal)
                changed = law(np.column_stack([table[name] for name in names]))
                table.update(zip(names, np.asarray(changed, float).T))

    def keep(self, choose: Callable[[Table], np.ndarray]) -> None:
        """Keep the rows of every log that a function chooses, as flags or as numbers."""
        for name, table in self.logs.items():
            rows = choose(table)
            self.logs[name] = {head: column[rows] for head, column in table.items()}

    def stated(self, section: str, key: str) -> Any:
        """Return what ``robot.toml`` states, a number per joint for a list.

        Raises
        ------
        DoesNotApplyError
            If it states nothing of the kind.

        """
        table = tomllib.loads(self.robot).get(section, {})
        if key not in table:
            raise DoesNotApplyError(f"no [{section}] {key} is stated")
        value = table[key]
        return np.array(value, float) if isinstance(value, list) else value

    def state(self, section: str, key: str, values: np.ndarray) -> None:
        """Write other numbers into ``robot.toml`` and leave the rest of its text as it is."""
        start = re.search(rf"^\[{re.escape(section)}\].*$", self.robot, re.MULTILINE)
        assert start is not None, section
        before, after = self.robot[:start.end()], self.robot[start.end():]
        text = "[" + ", ".join(f"{value:.{DIGITS}g}" for value in values) + "]"
        self.robot = before + re.sub(rf"^({re.escape(key)}\s*=\s*)\[[^\]]*\]",
                                     lambda match: match[1] + text, after, count=1,
                                     flags=re.MULTILINE)


def columns(table: Table, signal: str) -> list[str]:
    """Headers of a signal, in the order of the joints.

    Raises
    ------
    DoesNotApplyError
        If the log does not hold the signal.

    """
    found = [name for name in table if re.fullmatch(rf"{signal}\d*", name)]
    if not found:
        raise DoesNotApplyError(f"{signal} is not logged")
    return sorted(found, key=lambda name: int(name[len(signal):] or 1))


def period(table: Table) -> float:
    """Usual step of the clock of a log."""
    return float(np.median(np.diff(table["time"])))


def _read(path: Path) -> Table:
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    head, _, rows = text.decode().partition("\n")
    values = np.loadtxt(rows.splitlines(), delimiter=",", ndmin=2)
    return dict(zip(head.strip().split(","), values.T.copy()))


def _text(table: Table, clock_digits: int) -> str:
    digits = [clock_digits if name == "time" else DIGITS for name in table]
    form = ",".join(f"%.{count}g" for count in digits)
    rows = zip(*(column.tolist() for column in table.values()))
    return "\n".join([",".join(table), *(form % row for row in rows), ""])
