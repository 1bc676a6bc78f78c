"""NPZ archives of plain arrays; size and kind are checked before anything is loaded."""

import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.readers.bombs import refuse_bomb
from clie_blocks.analysis.records.readers.options import Options, library_errors
from clie_blocks.analysis.records.table import Table, table_of
from clie_blocks.errors import RecordError

LARGEST = 1_000_000_000  # bytes unpacked


def read(path: Path, options: Options) -> list[Table]:
    """Return the arrays of an NPZ file, as a list of one table.

    Arrays (N,) and (N, k) of the length most arrays have; others are named and left out.

    Raises
    ------
    RecordError
        If it would unpack to more than a gigabyte, or holds Python objects.

    """
    with library_errors(path, "NPZ"):
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST:
            raise RecordError(f"{path} would unpack to {size / 1e9:.2f} GB, more than the limit "
                              f"of {LARGEST / 1e9:g} GB; store only the signals that are needed")
        refuse_bomb(path, size)
        arrays = _arrays(path)
    if not arrays:
        raise RecordError(f"{path} has no numeric array; save the signals with dtype=float")
    return [table_of(of_one_length(arrays, path), str(path))]


def _arrays(path: Path) -> dict[str, np.ndarray]:
    arrays = {}
    with np.load(path, allow_pickle=False) as archive:
        for name in archive.files:
            try:
                arrays[name] = archive[name]
            except ValueError as error:
                if "pickle" in str(error).lower():
                    raise RecordError(
                        f"{path}: array {name!r} holds Python objects, and loading them would run "
                        "code; save it with dtype=float") from None
                raise
    return {name: array for name, array in arrays.items()
            if isinstance(array, np.ndarray) and array.dtype.kind in "biuf"}


def of_one_length(arrays: Mapping[str, np.ndarray],
                  path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Return the columns of the most common length, matrices with one row per sample.

    Scalars and arrays of other lengths are left out.
    """
    lengths: dict[int, int] = {}
    for array in arrays.values():
        if 1 <= array.ndim <= 2 and array.size > 1:
            lengths[max(array.shape)] = lengths.get(max(array.shape), 0) + 1
    if not lengths:
        raise RecordError(f"{path} has no array with more than one sample; save each signal as an "
                          "array with one row per sample")
    length = max(lengths, key=lambda size: (lengths[size], size))
    columns = {}
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] != length and array.shape[1] == length:
            array = array.T
        if array.ndim == 2 and array.shape[1] == 1:
            array = array[:, 0]
        if array.ndim in (1, 2) and array.shape[0] == length:
            columns[name] = array
    return columns
