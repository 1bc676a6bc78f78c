"""Parquet tables, row group by row group."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers import emps
from clie_blocks.analysis.records.readers.bombs import refuse_bomb
from clie_blocks.analysis.records.readers.options import Options, library_errors, need
from clie_blocks.analysis.records.table import Table
from clie_blocks.errors import RecordError

LARGEST = 100_000_000  # rows, a day at 1 kHz
BATCH = 100_000  # rows


def read(path: Path, options: Options) -> list[Record] | list[Table]:
    """Return the log in a Parquet file, as a list of one table.

    Columns that hold lists of numbers of one length become ``name[0], name[1], ...``.

    """
    pq = need("pyarrow.parquet", "reading Parquet", "parquet", "pyarrow")
    with library_errors(path, "Parquet"):
        file = pq.ParquetFile(path)
        if file.metadata.num_rows > LARGEST:
            raise RecordError(f"{path} states {file.metadata.num_rows} rows; a robot log has "
                              f"fewer than {LARGEST}: cut it into runs")
        refuse_bomb(path, 8 * file.metadata.num_rows * len(file.schema_arrow))
        names, cells = _names(file)
        refuse_bomb(path, 8 * file.metadata.num_rows * len(names))
    if emps.is_emps(names):
        return [emps.record(emps.columns_of(path), str(path))]

    def blocks(indices: Sequence[int]) -> Iterator[np.ndarray]:
        with library_errors(path, "Parquet"):
            wanted = list(dict.fromkeys(cells[index][0] for index in indices))
            for batch in file.iter_batches(BATCH, columns=wanted):
                yield np.column_stack([_cell(batch, *cells[index]) for index in indices])

    return [Table(tuple(names), blocks, str(path))]


def _names(file: Any) -> tuple[list[str], list[tuple[str, int | None]]]:
    """Column names, and for each the Parquet column and the position in its list."""
    import pyarrow as pa

    head = next(file.iter_batches(1), None)
    names: list[str] = []
    cells: list[tuple[str, int | None]] = []
    for field in file.schema_arrow:
        if pa.types.is_list(field.type) or pa.types.is_fixed_size_list(field.type):
            first = head[field.name][0].as_py() if head is not None and head.num_rows else None
            for k in range(len(first or ())):
                names.append(f"{field.name}[{k}]")
                cells.append((field.name, k))
        else:
            names.append(field.name)
            cells.append((field.name, None))
    return names, cells


def _cell(batch: Any, name: str, position: int | None) -> np.ndarray:
    column = batch[name]
    if position is None:
        array = column.to_numpy(zero_copy_only=False)
        if array.dtype.kind in "mM":  # dates and durations count from 1970 or 0, in nanoseconds
            array = array.astype(f"{array.dtype.kind}8[ns]").astype(np.int64)
        return np.asarray(array, float)
    flat = np.asarray(column.flatten().to_numpy(zero_copy_only=False), float)
    if flat.size % len(column):
        raise RecordError(f"column {name!r} holds lists of different lengths; export one "
                          "column per joint")
    return flat.reshape(len(column), -1)[:, position]
