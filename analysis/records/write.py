"""Writing a record as CSV with the canonical columns ``time, q1, ..., u1, ...``."""

import gzip
import io
import os
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.model import DEFAULT_UNITS, Record
from clie_blocks.errors import RecordError
from clie_blocks.output import write


def write_record(record: Record, path: str | os.PathLike[str]) -> Path:
    """Write a record as CSV; `read_record` gives the same arrays back, bit for bit.

    Joints without names of their own are numbered, ``q1``; others are named, ``q_elbow``.  Units
    other than the canonical ones stand in the header, ``q1[m]``.  Missing values are empty cells;
    a column ``valid`` follows where samples are masked.

    Parameters
    ----------
    record : Record
        What to write; `extra` is not written.
    path : path-like
        ``.csv`` or ``.csv.gz``.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    RecordError
        If the name has another ending, or a joint name cannot stand in a header.

    """
    path = Path(path)
    if not path.name.endswith((".csv", ".csv.gz")):
        raise RecordError(f"{path} must end in .csv or .csv.gz")
    text = _text(record)
    if path.suffix == ".gz":
        buffer = io.BytesIO()
        with gzip.GzipFile(fileobj=buffer, mode="wb", compresslevel=6, mtime=0) as file:
            file.write(text.encode())
        return write(path, buffer.getvalue())
    return write(path, text)


def _text(record: Record) -> str:
    columns = [record.time, *(getattr(record, name) for name in record.signals)]
    header = _header(record)
    if not record.valid.all():
        columns.append(record.valid)
        header.append("valid")
    lines = [",".join(header)]
    for row in np.column_stack(columns).tolist():
        lines.append(",".join([repr(value) if value == value else "" for value in row]))
    return "\n".join(lines) + "\n"


def _header(record: Record) -> list[str]:
    bad = [name for name in record.joints if set(name) & set(',;"\n\r\t|[]()')]
    if bad:
        raise RecordError(f"joint name {bad[0]!r} cannot stand in a CSV header; rename the joint")
    numbered = record.joints == tuple(f"joint{k + 1}" for k in range(record.n))
    names = ["time"]
    for signal in record.signals:
        for k, joint in enumerate(record.joints):
            unit = record.units[signal][k]
            stated = "" if unit == DEFAULT_UNITS[signal] else f"[{unit}]"
            names.append(f"{signal}{k + 1}{stated}" if numbered else f"{signal}_{joint}{stated}")
    return names
