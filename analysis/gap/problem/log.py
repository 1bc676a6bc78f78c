"""One experiment as the diagnosis reads it."""

import dataclasses

import numpy as np

from clie_blocks.analysis.records import Record, Robot
from clie_blocks.errors import RecordError
from clie_blocks.linear_filters import high_pass

LEAST_SAMPLES = 400  # of a log that can be diagnosed
# Of the range of motion, between the stated start and the first sample of one run.
LARGEST_START_ERROR = 0.1
NOISE_CORNER = 30.0  # Hz, above which a measured position is noise


@dataclasses.dataclass(frozen=True, eq=False)
class Log:
    """One experiment; arrays have shape (N, n), torques are motor side [N m], angles joint side.

    Parameters
    ----------
    name : str
        Of its source.
    q, u, q_d, pe : ndarray, shape (N, n)
        Measured position [rad], command [N m], reference [rad], excitation [N m].
    start : ndarray, shape (n,)
        Position in which the controller began [rad].
    at_rest : bool
        Whether the log begins with the controller at rest.
    dither : ndarray, shape (N, n)
        Measured noise of the position, above all motion [rad]: the model feeds it through the
        loop as the robot did, where it keeps dry friction from holding a joint for good.
    speed : ndarray, shape (n,), or float
        Velocity at the first sample, of logs that begin in motion [rad/s].
    measured : ndarray of bool, shape (N,), or None
        Samples that count: the others were lost, and what stands there is filled in; None where
        all count.
    began : float
        Time of the first sample in its record [s]: a record with a long gap is several logs.

    """

    name: str
    q: np.ndarray
    u: np.ndarray
    q_d: np.ndarray
    pe: np.ndarray
    start: np.ndarray
    at_rest: bool
    dither: np.ndarray
    speed: np.ndarray | float = 0.0
    measured: np.ndarray | None = None
    began: float = 0.0

    def __len__(self) -> int:
        return len(self.q)

    @property
    def measured_q(self) -> np.ndarray:
        """Positions that were measured [rad], without those that were filled in."""
        return self.q if self.measured is None else self.q[self.measured]

    @property
    def ends_of_gaps(self) -> np.ndarray:
        """First samples behind gaps, inside which nothing says what the controller did."""
        if self.measured is None:
            return np.zeros(0, int)
        return np.flatnonzero(self.measured[1:] & ~self.measured[:-1]) + 1

    def bridged(self, error: np.ndarray) -> np.ndarray:
        """An error (N, n) of a model, bridged over the samples that do not count."""
        if self.measured is None:
            return error
        every, known = np.arange(len(self)), np.flatnonzero(self.measured)
        return np.stack([np.interp(every, known, column[known]) for column in error.T], axis=1)


def as_logs(record: Record, robot: Robot, k: int) -> list[Log]:
    """Record k of a robot as the diagnosis reads it: one log per piece of it."""
    if len(record.segments) == 1:
        return [as_log(record, robot, k)]
    parts = [record.part(*ends) for ends in record.segments]
    whole = [part for part in parts if len(part) >= LEAST_SAMPLES]
    logs = [as_log(part, robot, k) for part in whole or parts]
    return [log if part is parts[0] else dataclasses.replace(
                log, name=f"{log.name}, from {part.time[0]:.4g} s", start=log.q[0], at_rest=False,
                began=float(part.time[0] - parts[0].time[0]))
            for log, part in zip(logs, whole or parts)]


def as_log(record: Record, robot: Robot, k: int) -> Log:
    """Record k of a robot as the diagnosis reads it.

    Raises
    ------
    RecordError
        If the record has no command.

    """
    if record.u is None:
        raise RecordError(f"{record.source} has no command u; without it the controller cannot be "
                          "checked: log what it commands")
    at_rest = np.repeat(record.q[:1], len(record), axis=0)
    stem = f"log-{k + 1}"
    start = _plausible_start(getattr(robot.experiments.get(stem), "start", None), record.q)
    return Log(name=record.source or stem, q=record.q, u=record.u,
               q_d=at_rest if record.qd is None else record.qd,
               pe=np.zeros_like(record.q) if record.pe is None else record.pe,
               start=record.q[0] if start is None else start, at_rest=start is not None,
               dither=_dither(record.q, record.sample_time),
               measured=None if record.valid.all() else record.valid)


def _plausible_start(start: np.ndarray | None, q: np.ndarray) -> np.ndarray | None:
    """Return the stated start, or None where the log begins elsewhere: in another run."""
    if start is None:
        return None
    if np.abs(q[0] - start).max() > LARGEST_START_ERROR * np.ptp(q, axis=0).max():
        return None
    return start


def _dither(q: np.ndarray, period: float) -> np.ndarray:
    """Part of the measured positions above all motion [rad]."""
    return high_pass(q, 2, min(NOISE_CORNER, 0.2 / period), 1.0 / period)
