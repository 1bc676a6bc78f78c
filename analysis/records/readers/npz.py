"""NPZ archives of plain arrays; size and kind are checked before anything is loaded."""

import zipfile

import numpy as np

from clie_blocks.analysis.records.readers.options import foreign
from clie_blocks.analysis.records.table import table_of
from clie_blocks.errors import RecordError

LARGEST = 1_000_000_000  # bytes unpacked


def read(path, options):
    """Return the arrays of an NPZ file, as a list of one table.

    Arrays (N,) and (N, k) of the length most arrays have; others are named and left out.

    Raises
    ------
    RecordError
        If it would unpack to more than a gigabyte, or holds Python objects.

    """
    with foreign(path, "NPZ"):
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST:
            raise RecordError(f"{path} would unpack to {size / 1e9:.2f} GB, more than the limit "
                              f"of {LARGEST / 1e9:g} GB; store only the signals that are needed")
        arrays = _arrays(path)
    if not arrays:
        raise RecordError(f"{path} holds no numeric array")
    return [table_of(of_one_length(arrays, path), str(path))]


def _arrays(path):
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
    return {name: array for name, array in arrays.items() if array.dtype.kind in "biuf"}


def of_one_length(arrays, path):
    """Return the columns of the commonest length, matrices turned upright.

    Parameters
    ----------
    arrays : dict of str to ndarray
        What the file holds; scalars and arrays of other lengths are left out.
    path : path-like
        For messages.

    """
    lengths = {}
    for array in arrays.values():
        if 1 <= array.ndim <= 2 and array.size > 1:
            lengths[max(array.shape)] = lengths.get(max(array.shape), 0) + 1
    if not lengths:
        raise RecordError(f"{path} holds no array with more than one sample")
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
