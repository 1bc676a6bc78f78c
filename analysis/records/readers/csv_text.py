"""CSV and its relatives: separators, decimal comma, BOM, comments, quoted lists, gzip.

The file is read in blocks, so that memory holds the wanted columns and one block.  A block is
parsed by numpy's own parser; only a block with something unusual in it (an empty cell, a fault) is
parsed again line by line, which finds the line and the column to blame.
"""

import contextlib
import csv
import datetime
import gzip
import io
import os
import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple, Self, cast

import numpy as np

from clie_blocks.analysis.records.readers.bombs import HARMLESS, refuse_bomb
from clie_blocks.analysis.records.readers.dialect import LISTED, Dialect, sniff
from clie_blocks.analysis.records.readers.options import Options
from clie_blocks.analysis.records.table import Table
from clie_blocks.errors import RecordError

BLOCK = 4_000_000  # bytes
SLOW = 200_000_000  # bytes from which on the progress is shown
HEAD = 200_000
MISSING = {"", "nan", "na", "n/a", "null", "none", "-", "#n/a"}
WORDS = {"true": 1.0, "false": 0.0}


def read(path: Path, options: Options) -> list[Table]:
    """Return the log in a delimited text file, as a list of one table.

    Gzip is recognised by its content.  Faults are named with file, line and column.
    """
    with _opened(path) as file, _Readable(path):
        if isinstance(file, gzip.GzipFile):
            _refuse_packed_bomb(file, path)
        head = file.read(HEAD)
    dialect = sniff(head, path)
    decisions = list(dialect.decisions)

    def blocks(indices: Sequence[int]) -> Iterator[np.ndarray]:
        return _blocks(path, dialect, indices, decisions)

    return [Table(dialect.names, blocks, str(path), decisions)]


def _opened(path: Path) -> IO[bytes]:
    with open(path, "rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    return cast(IO[bytes], gzip.open(path, "rb") if packed else open(path, "rb"))


def _refuse_packed_bomb(packed: gzip.GzipFile, path: Path) -> None:
    """Unpack a file that claims to be a bomb, and drop it block by block."""
    with open(path, "rb") as file:
        file.seek(-4, os.SEEK_END)  # there gzip says how long the text is, modulo 4 GB
        claimed = int.from_bytes(file.read(), "little")
    if claimed <= HARMLESS:
        return
    size = 0
    while block := packed.read(BLOCK):
        size += len(block)
        refuse_bomb(path, size)
    packed.seek(0)


class _Readable:
    """Turns what goes wrong while bytes are read into a message."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if kind and issubclass(kind, (EOFError, zlib.error, OSError)):
            reason = "it ends too early" if kind is EOFError else str(error)
            raise RecordError(f"{self.path} cannot be unpacked: {reason}; copy or export it "
                              "again") from None


def _blocks(path: Path, dialect: Dialect, indices: Sequence[int],
            decisions: list[str]) -> Iterator[np.ndarray]:
    line = 1
    with _opened(path) as file, _Readable(path), _progress(path) as advance:
        for text, last in _texts(file, path):
            advance(len(text))
            start = line
            line += text.count(b"\n")
            if start == 1:
                text, skipped = _body(text, dialect)
                start += skipped
            if text.strip():
                yield _parsed(text, dialect, indices, _Place(path, start, last, decisions))


def _progress(path: Path) -> contextlib.AbstractContextManager[Callable[[int], None]]:
    size = path.stat().st_size
    if size < SLOW:
        return contextlib.nullcontext(lambda amount: None)
    from clie_blocks.output import progress

    return progress(f"reading {path.name}", size)


def _texts(file: IO[bytes], path: Path) -> Iterator[tuple[bytes, bool]]:
    """Yield whole lines in blocks, and whether the block is the last."""
    rest, size = b"", 0
    while True:
        chunk = file.read(BLOCK)
        size += len(chunk)
        refuse_bomb(path, size)
        text = rest + chunk
        if b"\n" not in text and b"\r" in text:
            text = text.replace(b"\r", b"\n")
        if not chunk:
            yield text.replace(b"\r", b""), True
            return
        end = text.rfind(b"\n") + 1
        if not end and len(text) > BLOCK:
            raise RecordError(f"{path} has a line of more than {BLOCK} bytes; it is not a log "
                              "in rows and columns")
        if end:
            yield text[:end].replace(b"\r", b""), False
        rest = text[end:]


def _body(text: bytes, dialect: Dialect) -> tuple[bytes, int]:
    """Cut off what stands before the first row."""
    parts = text.split(b"\n", dialect.skip)
    return (parts[-1] if len(parts) > dialect.skip else b""), dialect.skip


class _Place(NamedTuple):
    """Where a block begins, for messages, and where to write decisions."""

    path: Path
    line: int
    last: bool
    decisions: list[str]


def _parsed(text: bytes, dialect: Dialect, indices: Sequence[int], place: _Place) -> np.ndarray:
    commented = any(mark in text for mark in dialect.comments)
    plain = _plain_text(text, dialect)
    if not plain.strip():
        return np.empty((0, len(indices)))
    if not commented:
        try:
            rows = np.loadtxt(io.StringIO(_filled(plain, dialect.delimiter)),
                              delimiter=dialect.delimiter, usecols=indices, comments=None,
                              ndmin=2, quotechar='"' if '"' in plain else None)
        except (ValueError, OverflowError, IndexError):
            rows = None
        if rows is not None and _is_regular(plain, dialect, len(rows)):
            return rows
    return _line_by_line(plain, dialect, indices, place)


def _plain_text(text: bytes, dialect: Dialect) -> str:
    plain = text.decode("latin-1")
    if dialect.lists:
        plain = plain.translate(LISTED)
    return plain.replace(",", ".") if dialect.decimal_comma else plain


def _filled(plain: str, delimiter: str | None) -> str:
    """Write nan into empty cells, so that numpy can read them."""
    if delimiter is None or '"' in plain:
        return plain
    for _ in range(2):  # the separator between two empty cells belongs to both
        plain = plain.replace(2 * delimiter, f"{delimiter}nan{delimiter}")
    plain = plain.replace(f"{delimiter}\n", f"{delimiter}nan\n")
    return plain.replace(f"\n{delimiter}", f"\nnan{delimiter}")


def _is_regular(plain: str, dialect: Dialect, rows: int) -> bool:
    """Whether every row has as many separators as the header, where that can be counted."""
    if dialect.delimiter is None:
        return len(plain.split()) == rows * len(dialect.names)
    return plain.count(dialect.delimiter) == rows * (len(dialect.names) - 1)


def _line_by_line(plain: str, dialect: Dialect, indices: Sequence[int],
                  place: _Place) -> np.ndarray:
    lines = plain.split("\n")
    rows = []
    for number, line in enumerate(lines, place.line):
        if not line.strip() or line.lstrip().startswith(dialect.marks):
            continue
        fields = _fields(line, dialect)
        if len(fields) != len(dialect.names):
            if place.last and number - place.line == len(lines) - 1:
                place.decisions.append(f"Left out line {number}, the last one, which is cut off.")
                continue
            raise RecordError(
                f"{place.path}:{number}: this line has {len(fields)} values, the header has "
                f"{len(dialect.names)} columns: {line[:80]!r}; a shifted value would go to the "
                "wrong signal, so correct or delete the line")
        stamp = _date(fields[indices[0]])
        if stamp is not None:
            fields[indices[0]] = repr(stamp)
        rows.append([_number(fields[index], place, number, index, dialect) for index in indices])
    return np.array(rows, float).reshape(-1, len(indices))


def _fields(line: str, dialect: Dialect) -> list[str]:
    if dialect.delimiter is None:
        return line.split()
    if '"' in line:
        fields = next(csv.reader([line], delimiter=dialect.delimiter), [])
    else:
        fields = line.split(dialect.delimiter)
    if len(fields) == len(dialect.names) + 1 and not fields[-1].strip():
        fields.pop()
    return fields


def _date(field: str) -> float | None:
    """Seconds since 1970 of a date with time, or None; without a zone it counts as UTC."""
    if ":" not in field:
        return None
    try:
        date = datetime.datetime.fromisoformat(field.strip())
        return date.replace(tzinfo=date.tzinfo or datetime.UTC).timestamp()
    except (ValueError, OverflowError):
        return None


def _number(field: str, place: _Place, line: int, index: int, dialect: Dialect) -> float:
    word = field.strip().lower()
    if word in MISSING:
        return float("nan")
    if word in WORDS:
        return WORDS[word]
    try:
        if re.fullmatch(r"[\x21-\x5e\x60-\x7e]+", word):
            return float(word)
    except ValueError:
        pass
    raise RecordError(f"{place.path}:{line}:{index + 1}: {field.strip()[:40]!r} in column "
                      f"{dialect.names[index]!r} is not a number; correct the cell, or leave it "
                      "empty for a missing value")
