"""One experiment as the diagnosis reads it."""

import dataclasses
import functools
from collections.abc import Mapping

import numpy as np

from clie_blocks.analysis.gap.problem.noise_above_motion import noise_above_motion
from clie_blocks.analysis.gap.problem.ticks import between_samples, spread
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.model import SUPPLY
from clie_blocks.analysis.records.two_encoders import other_encoder
from clie_blocks.robot_loop.sampled_law import OF_DRIVE

LEAST_SAMPLES = 400  # of a log that can be diagnosed
# Of the range of motion, between the stated start and the first sample of one run.
LARGEST_START_ERROR = 0.1
SHORTEST_CUT = 3  # steps: what happened in a longer gap is more than a pulse
NEARLY_ALL = 0.98  # of the steps of a log are no gaps
NOISE_CORNER = 30.0  # Hz, above which a measured position is noise


@dataclasses.dataclass(frozen=True, eq=False)
class Log:
    """One experiment; arrays have shape (N, n), torques are motor side [N m], angles joint side.

    There is a row at every tick of the controller, also where it ran faster than it was logged:
    there the signals between two samples are filled in.

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
        Ticks of samples that count: between them, and where samples were lost, signals are filled
        in; None where every tick was measured.
    began : float
        Time of the first sample in its record [s]: a record with a long gap is several logs.
    stride : int
        Ticks of the controller per sample.
    other_q : ndarray, shape (N, n), or None
        Positions that another encoder of the joints measured [rad], see `two_encoders`.
    of_other_encoder : bool
        Whether `q` is of the encoder on which the law does not act, and `other_q` of the law's.
    law_state : ndarray, shape (states,), or None
        State of a law of the user's own at the first sample.
    added : ndarray, shape (N, n), or float
        What of `pe` no excitation was: part of the recorded command that models follow [N m].
    of_drive : mapping
        Velocity ``dq`` [rad/s] and torque ``tau`` [as logged] that the drives measured, of shape
        (N, n), where they were logged; a law of the user's own may read them.
    drive_rest, drive_dither : ndarray, shape (N, m), or None
        What such a law reads beyond what its models form, and what of it is noise above all
        motion: inputs of their loop, see `drive_signals`.
    rounding : ndarray, shape (N, n), or None
        What of `dither` the counts of coarse encoders add to the position, which is read between
        them; zero at all other joints, None where no encoder is coarse.
    supply : ndarray, shape (N, n), or None
        Voltage of the drives over its nominal value, by which their torque grows; None where it
        was not logged, or the drives control their current.

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
    stride: int = 1
    other_q: np.ndarray | None = None
    of_other_encoder: bool = False
    law_state: np.ndarray | None = None
    added: np.ndarray | float = 0.0
    of_drive: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)
    drive_rest: np.ndarray | None = None
    drive_dither: np.ndarray | None = None
    rounding: np.ndarray | None = None
    supply: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.q)

    def sample_count(self) -> int:
        """Number of samples, of a log that may have more ticks."""
        return len(self) // self.stride

    def following(self, torque: np.ndarray) -> "Log":
        """The log with a part of its recorded command that models follow, shape (N, n)."""
        return dataclasses.replace(self, pe=self.pe + torque, added=self.added + torque)

    @property
    def supplied_u(self) -> np.ndarray:
        """Commands as a sound drive gives them under its voltage [N m]."""
        return self.u if self.supply is None else self.u * self.supply

    @property
    def law_q(self) -> np.ndarray:
        """Positions on which the law acts [rad]."""
        return self.other_q if self.of_other_encoder and self.other_q is not None else self.q

    @property
    def measured_q(self) -> np.ndarray:
        """Positions that were measured [rad], without those that were filled in."""
        return self.q if self.measured is None else self.q[self.measured]

    @property
    def counted(self) -> np.ndarray | None:
        """Mask of the samples that count, one value per `stride` ticks; None where all do."""
        if self.measured is None or self.measured[::self.stride].all():
            return None
        return self.measured[::self.stride]

    @functools.cached_property
    def sample_ticks(self) -> np.ndarray:
        """Ticks of the samples that count."""
        every = np.arange(0, len(self), self.stride)
        return every if self.counted is None else every[self.counted]

    @functools.cached_property
    def usual_step(self) -> int:
        """Ticks from one sample to the next, at most, of a logger that loses none.

        Where most samples follow each other at once, others between them were lost.
        """
        steps = np.diff(self.sample_ticks)
        if self.counted is None or np.median(steps) == self.stride:
            return self.stride
        return int(np.quantile(steps, NEARLY_ALL))

    @property
    def shows_every_tick(self) -> bool:
        """Whether the log has a sample of each tick of its controller, but for lost ones."""
        return self.usual_step == 1

    @functools.cached_property
    def seen(self) -> np.ndarray:
        """Mask of the ticks that no gap lies over, shape (N,)."""
        seen = np.zeros(len(self), bool)
        seen[self.sample_ticks] = True
        for behind in (np.flatnonzero(np.diff(self.sample_ticks) <= self.usual_step) + 1).tolist():
            seen[self.sample_ticks[behind - 1]:self.sample_ticks[behind]] = True
        return seen

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """Last tick before, and first tick behind, samples that were lost."""
        known = self.sample_ticks
        before = np.flatnonzero(np.diff(known) > self.usual_step)
        return [(int(known[i]), int(known[i + 1])) for i in before]

    @property
    def cuts(self) -> list[int]:
        """First ticks whose state nothing before them tells: behind gaps, and of later pieces."""
        behind = [behind for before, behind in self.gaps
                  if behind - before > SHORTEST_CUT * self.stride]
        return [0, *behind] if self.began > 0.0 else behind

    def bridged(self, error: np.ndarray) -> np.ndarray:
        """An error (N, n) of a model, bridged over the ticks that do not count."""
        if self.measured is None:
            return error
        every, known = np.arange(len(self)), np.flatnonzero(self.measured)
        return np.stack([np.interp(every, known, column[known]) for column in error.T], axis=1)

    def at_samples(self, values: np.ndarray) -> np.ndarray:
        """Values of the samples at every tick: each stands for the ticks up to the next one."""
        if self.shows_every_tick:
            return values
        latest = np.searchsorted(self.sample_ticks, np.arange(len(self)), side="right") - 1
        return values[self.sample_ticks[np.maximum(latest, 0)]]


def as_logs(record: Record, robot: Robot, k: int, period: float) -> list[Log]:
    """Record k of a robot as the diagnosis reads it: one log per piece of it.

    The controller has a tick every `period` [s], at least as often as the record has a sample.
    """
    stride = max(1, round(record.sample_time / period))
    if len(record.segments) == 1:
        return [as_log(record, robot, k, stride)]
    parts = [record.part(*ends) for ends in record.segments]
    whole = [part for part in parts if len(part) >= LEAST_SAMPLES]
    return [_piece(part, robot, k, stride, record.time[0]) for part in whole or parts]


def _piece(part: Record, robot: Robot, k: int, stride: int, first: float) -> Log:
    """One piece of record k, which began at a time [s]; behind a cut nothing is known of it."""
    log = as_log(part, robot, k, stride)
    began = float(part.time[0] - first)
    return log if began == 0.0 else dataclasses.replace(
        log, name=f"{log.name}, from {began:.4g} s", start=log.q[0], at_rest=False, began=began)


def as_log(record: Record, robot: Robot, k: int, stride: int = 1) -> Log:
    """Record k of a robot as the diagnosis reads it, with some ticks of the controller per sample.

    A command that was not logged is NaN.
    """
    dither = noise_above_motion(record.q, NOISE_CORNER, 1.0 / record.sample_time)
    if stride > 1:
        record, dither = between_samples(record, stride), spread(dither, stride)
    at_rest = np.repeat(record.q[:1], len(record), axis=0)
    stem = f"log-{k + 1}"
    start = _plausible_start(getattr(robot.experiments.get(stem), "start", None), record.q)
    return Log(name=record.source or stem, q=record.q,
               u=np.full_like(record.q, np.nan) if record.u is None else record.u,
               q_d=at_rest if record.qd is None else record.qd,
               pe=np.zeros_like(record.q) if record.pe is None else record.pe,
               start=record.q[0] if start is None else start, at_rest=start is not None,
               dither=dither, measured=None if record.valid.all() else record.valid,
               stride=stride, other_q=other_encoder(record),
               of_drive={name: record.signal(name) for name in OF_DRIVE
                         if getattr(record, name) is not None},
               supply=_relative_supply(record, robot))


def _relative_supply(record: Record, robot: Robot) -> np.ndarray | None:
    """Logged voltage of the drives over the stated one, shape (N, n), where both are known."""
    nominal, volts = robot.controller.supply, record.extra.get(SUPPLY)
    if nominal is None or volts is None or not np.isfinite(volts).any():
        return None
    known = np.flatnonzero(np.isfinite(volts))
    whole = np.interp(np.arange(len(record)), known, volts[known])
    return np.repeat(whole[:, None] / nominal, record.n, axis=1)


def _plausible_start(start: np.ndarray | None, q: np.ndarray) -> np.ndarray | None:
    """Return the stated start, or None where the log begins elsewhere: in another run."""
    if start is None:
        return None
    if np.abs(q[0] - start).max() > LARGEST_START_ERROR * np.ptp(q, axis=0).max():
        return None
    return start
