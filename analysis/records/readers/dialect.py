"""How a delimited text file is written: separator, decimal mark, header, comments, lists."""

import csv
import dataclasses
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from clie_blocks.analysis.records.units import SPELLINGS, TO_SI
from clie_blocks.errors import RecordError

SEPARATORS = (";", "\t", ",", "|", None)  # None is white space
MARKS = ("#", "%", "//")
SAMPLE = 50  # lines looked at
HALF = 100_000  # bytes; a longer head may end within a line
LISTED = str.maketrans("", "", '[]"')
NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)?", re.I)


@dataclasses.dataclass(frozen=True)
class Dialect:
    """How a file is written; `skip` lines stand before the first row."""

    names: tuple[str, ...]
    delimiter: str | None
    skip: int
    decimal_comma: bool
    lists: bool
    decisions: tuple[str, ...]
    marks: tuple[str, ...] = MARKS

    @property
    def comments(self) -> tuple[bytes, ...]:
        """Comment marks as bytes."""
        return tuple(mark.encode() for mark in self.marks)


def sniff(head: bytes, path: Path) -> Dialect:
    """Return the dialect of a file from its first bytes; refuse what is no table in text."""
    lines = _text(head, path).split("\n")
    if len(head) > HALF and len(lines[0]) > HALF:
        raise RecordError(f"{path}:1: the first line has more than {HALF} characters, and a "
                          "header has a few hundred; export the log in rows and columns")
    if len(head) > HALF and len(lines) > 1:
        lines.pop()  # it goes on beyond what was read
    rows = [(number, line) for number, line in enumerate(lines)
            if line.strip() and not line.lstrip().startswith(MARKS)
            and not re.fullmatch(r"\s*sep=.\s*", line)]  # how a spreadsheet names its separator
    if not rows:
        raise RecordError(f"{path} has no line with values; check that the log is not empty")
    delimiter = _separator([line for _, line in rows[:SAMPLE]])
    first = _split(rows[0][1], delimiter)
    notes = []
    if _numeric(first):
        names = _header_in_comment(lines[:rows[0][0]], delimiter, len(first))
        if names is None:
            raise RecordError(f"{path}:{rows[0][0] + 1}: the log has no header, so the meaning "
                              f"of its {len(first)} columns is unknown; put a line such as "
                              "time,q1,u1 on top")
        skip, data = rows[0][0], rows
        notes.append("Took the header from a comment line.")
    else:
        names, skip, data = first, rows[0][0] + 1, rows[1:]
    if data and _are_units(fields := _split(data[0][1], delimiter), len(names)):
        names = [f"{name.strip()}[{unit.strip()}]" for name, unit in zip(names, fields)]
        skip, data = data[0][0] + 1, data[1:]
        notes.append("Took the units from the line below the header.")
    sample = [_split(line, delimiter) for _, line in data[:SAMPLE]]
    comma = delimiter != "," and _has_decimal_comma(sample)
    names, lists = _expanded([name.strip().strip('"').strip() for name in names], sample)
    notes += _remarks(delimiter, comma, lists)
    return Dialect(tuple(names), delimiter, skip, comma, lists, tuple(notes))


def _text(head: bytes, path: Path) -> str:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise RecordError(f"{path} is text in UTF-16; save it as UTF-8 or plain CSV")
    if b"\0" in head:
        raise RecordError(f"{path} is neither text nor a known log format; the known ones are "
                          "CSV, Parquet, NPZ, MATLAB, ROS 2 bag, MCAP and LeRobot folders")
    try:
        text = head.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = head.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    if "\n" not in text:
        return text.replace("\r", "\n")
    return text.replace("\r", "")


def _separator(lines: Sequence[str]) -> str | None:
    """The separator that gives most lines the same number of fields, more than one."""
    best: str | None = ","
    best_score = 0.0
    for delimiter in SEPARATORS:
        counts = Counter(len(_split(line, delimiter)) for line in lines)
        fields, hits = counts.most_common(1)[0]
        score = hits / len(lines) if fields > 1 else 0.0
        if score > best_score + 0.05:
            best, best_score = delimiter, score
    return best


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return line.split(delimiter)


def _numeric(fields: Sequence[str]) -> bool:
    return all(NUMBER.fullmatch(field.strip()) for field in fields)


def _are_units(fields: Sequence[str], count: int) -> bool:
    units = [field.strip() for field in fields]
    return len(units) == count and any(units) and all(
        unit in TO_SI or unit in SPELLINGS for unit in units) and not _numeric(fields)


def _header_in_comment(lines: Sequence[str], delimiter: str | None,
                       count: int) -> list[str] | None:
    for line in reversed(lines):
        names = _split(line.strip().lstrip("".join(MARKS)).strip(), delimiter)
        if len(names) == count and not _numeric(names):
            return names
    return None


def _has_decimal_comma(sample: Sequence[Sequence[str]]) -> bool:
    fields = [field.strip() for row in sample for field in row]
    return any(re.fullmatch(r"[+-]?\d*,\d+([eE][+-]?\d+)?", field) for field in fields) \
        and not any(re.fullmatch(r"[+-]?\d*\.\d+([eE][+-]?\d+)?", field) for field in fields)


def _expanded(names: list[str], sample: Sequence[Sequence[str]]) -> tuple[list[str], bool]:
    """Names with one entry per element of a quoted list, ``positions[0], positions[1]``."""
    first = sample[0] if sample else []
    if len(first) != len(names) or not any(field.strip().startswith("[") for field in first):
        return names, False
    wide = []
    for name, field in zip(names, first):
        if field.strip().startswith("["):
            wide += [f"{name}[{k}]" for k in range(field.count(",") + 1)]
        else:
            wide.append(name)
    return wide, True


def _remarks(delimiter: str | None, comma: bool, lists: bool) -> list[str]:
    shown = {";": "semicolon", "\t": "tab", "|": "bar", None: "white space"}
    notes = [f"The columns are separated by {shown[delimiter]}."] if delimiter != "," else []
    if comma:
        notes.append("Numbers have a decimal comma.")
    if lists:
        notes.append("Quoted lists were read as one column per element.")
    return notes
