"""MATLAB files, v5 and v7.3."""

from pathlib import Path

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers import emps
from clie_blocks.analysis.records.readers.mat_variables import read_columns
from clie_blocks.analysis.records.readers.options import Options
from clie_blocks.analysis.records.table import Table, table_of


def read(path: Path, options: Options) -> list[Record] | list[Table]:
    """Return the numeric variables of a MATLAB file, as a list of one table.

    Fields of a structure count as variables.  The archive of the EMPS benchmark is recognised by
    its variables and comes with its robot.

    """
    columns = read_columns(path)
    if emps.is_emps(columns):
        return [emps.record(columns, str(path))]
    return [table_of(columns, str(path))]
