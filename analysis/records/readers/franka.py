"""CSV that libfranka writes (``franka::logToCSV``): a command and the state one sample later.

A row holds the command sent at sample n and the state measured at sample n + 1.  The command that
belongs to a state stands therefore in the next row; the last state has none and is masked.
"""

import dataclasses
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.assemble import assemble
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers import csv_text
from clie_blocks.analysis.records.readers.options import Options

COMMANDED = ("u",)


def read(path: Path, options: Options) -> list[Record]:
    """Return the record of a libfranka log, with the shift between command and state repaired."""
    (table,) = csv_text.read(path, options)
    table = dataclasses.replace(table, time_unit="ms")  # RobotState::time.toMSec()
    record = assemble(table, options.robot, options.columns, options.time_unit)
    return [with_commands_in_step(record)]


def with_commands_in_step(record: Record) -> Record:
    """Return a record whose commands stand in the row of the state they were computed for."""
    later = {}
    for signal in COMMANDED:
        value = getattr(record, signal)
        if value is not None:
            later[signal] = np.vstack([value[1:], np.full((1, record.n), np.nan)])
    valid = record.valid.copy()
    valid[-1] = False
    return record.replace(**later, valid=valid).noted(
        "libfranka writes the command of sample n in the row of the state of sample n + 1; "
        "commands were moved by one row, and the last sample, which has none, is masked.")
