"""MATLAB files, v5 and v7.3, read in a child process with bounded memory and time."""

import numpy as np

from clie_blocks.analysis.records.readers import emps, sandbox
from clie_blocks.analysis.records.readers.npz import of_one_length
from clie_blocks.analysis.records.readers.options import foreign, need
from clie_blocks.analysis.records.table import table_of
from clie_blocks.errors import RecordError


def read(path, options):
    """Return the numeric variables of a MATLAB file, as a list of one table.

    Fields of a structure count as variables.  The archive of the EMPS benchmark is recognised by
    its variables and comes with its robot.

    """
    need("pymatreader", "reading MATLAB files", "mat")
    arrays, found = sandbox.run("mat.load", path)
    if not arrays:
        raise RecordError(f"{path} holds no numeric variable")
    columns = of_one_length(dict(zip(found["names"], arrays.values())), path)
    if emps.is_emps(columns):
        return [emps.record(columns, str(path))]
    return [table_of(columns, str(path))]


def load(path):
    """Return the numeric variables; runs in the child.

    Parameters
    ----------
    path : str
        The file.

    """
    import warnings

    from pymatreader import read_mat

    warnings.simplefilter("ignore")
    with foreign(path, "a MATLAB file"):
        variables = dict(_flat(read_mat(path)))
    return ({f"v{k}": value for k, value in enumerate(variables.values())},
            {"names": list(variables)})


def _flat(variables):
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
