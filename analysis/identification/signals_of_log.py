"""What identification needs of a log, or an error that says how to supply it."""

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot, as_checks_see
from clie_blocks.errors import NotIdentifiableError


def command(record: Record) -> np.ndarray:
    """Recorded command u, shape (N, n)."""
    return _present(record, "u", record.u)


def reference(record: Record) -> np.ndarray:
    """Recorded reference qd, shape (N, n)."""
    return _present(record, "qd", record.qd)


def excitation(record: Record) -> np.ndarray:
    """Injected excitation, shape (N, n), zero where none was logged."""
    return np.zeros(record.q.shape) if record.pe is None else record.pe


def robot_of(record: Record) -> Robot:
    """The robot that made the log."""
    if record.robot is None:
        raise NotIdentifiableError(f"{record.source}: it comes without a robot.toml, and without "
                                   "one no parameter can be identified; put one into the folder "
                                   "of the log, or name it with --robot")
    return as_checks_see(record.robot)


def _present(record: Record, name: str, signal: np.ndarray | None) -> np.ndarray:
    if signal is None:
        raise NotIdentifiableError(f"{record.source}: the log has no {name!r}, which is compared "
                                   "with the model; log it, or name its column with "
                                   f"--map {name}=COLUMN")
    return signal
