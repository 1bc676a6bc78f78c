"""Numeric variables of MATLAB files, read in a child process with bounded memory and time."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.readers import sandbox
from clie_blocks.analysis.records.readers.npz import of_one_length
from clie_blocks.analysis.records.readers.options import library_errors, need
from clie_blocks.errors import RecordError


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Return the numeric variables of the most common length by name, read in a child process."""
    need("pymatreader", "reading MATLAB files", "mat")
    arrays, info = sandbox.run("mat_variables.load", path)
    if not arrays:
        raise RecordError(f"{path} has no numeric variable; save the signals as arrays")
    return of_one_length(dict(zip(info["names"], arrays.values())), path)


def load(path: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the numeric variables; runs in the child."""
    import warnings

    from pymatreader import read_mat

    warnings.simplefilter("ignore")
    with library_errors(path, "a MATLAB file"):
        variables = dict(_flat(read_mat(path)))
    return ({f"v{k}": value for k, value in enumerate(variables.values())},
            {"names": list(variables)})


def _flat(variables: Mapping[str, Any]) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        if name.startswith(("__", "#")):
            continue
        if isinstance(value, dict):
            yield from _flat(value)
            continue
        try:
            array = np.asarray(value)
        except ValueError:
            continue
        if array.dtype.kind in "biuf" and array.size:
            yield name, array
