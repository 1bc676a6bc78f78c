"""The path of the torque from command to motor, where a log holds both.

No model of the robot is needed: the measured torque is a gain times the command, after a delay
and a first-order lag, plus an offset.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.position_path import CORRELATION_TIME, block_influence
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import lfilter

UNDRIVEN_SHARE = 0.05  # of the largest RMS command, below which a joint counts as not driven
_START_TIMES = ((0.01, 0.003), (0.003, 0.015))  # lag and delay [s] from which a fit begins
_BOUNDS = ((0.0, 0.0, 0.0, -np.inf), (5.0, 0.3, 0.2, np.inf))  # gain, lag, delay, offset
_SCALE = (0.1, 0.005, 0.005, 0.01)


@dataclasses.dataclass(frozen=True)
class TorquePath:
    """What the drive of one joint makes of its command.

    Parameters
    ----------
    joint : str
        Its name.
    gain : float
        Measured torque per commanded torque at rest.
    lag, delay : float
        Time constant, and dead time [s]; their sum is known better than either.
    offset : float
        Measured torque without command [N m].
    unexplained : float
        RMS of what this path does not explain, over that of the measured torque.
    half_widths : dict
        Of the 95 % intervals of ``gain`` and ``total_delay``.

    """

    joint: str
    gain: float
    lag: float
    delay: float
    offset: float
    unexplained: float
    half_widths: dict[str, float]

    @property
    def total_delay(self) -> float:
        """Delay of a torque that changes slowly: lag and delay together [s]."""
        return self.lag + self.delay


def torque_paths(record: Record) -> list[TorquePath]:
    """Fit the path of each joint that is driven.

    Raises
    ------
    NotIdentifiableError
        If one of the two torques is missing, or no joint is driven.
    """
    if record.u is None or record.tau is None:
        raise NotIdentifiableError(f"{record.source}: u or tau is missing; the path of the torque "
                                   "needs the commanded and the measured torque")
    driven = _driven_joints(record)
    if not driven:
        raise NotIdentifiableError(f"{record.source}: no joint is driven, u never changes")
    return [_fit_path([record], k) for k in driven]


def pooled_torque_path(records: Sequence[Record], k: int) -> TorquePath | None:
    """Fit one path of joint k to all logs in which it is driven; None where there is none."""
    driven = [record for record in records if k in _driven_joints(record)]
    return _fit_path(driven, k) if driven else None


def _driven_joints(record: Record) -> list[int]:
    """Joints whose command moves."""
    if record.u is None:
        return []
    size = np.std(record.u, axis=0)
    return np.flatnonzero((size > 0.0) & (size > UNDRIVEN_SHARE * size.max())).tolist()


def describe(record: Record) -> list[str]:
    """Path of each driven joint in a sentence; nothing where one of the torques is missing."""
    if record.u is None or record.tau is None or not np.ptp(record.u):
        return []
    return [f"{path.joint}: the measured torque is {path.gain:.2f} times the command, with a "
            f"delay of {1e3 * path.total_delay:.0f} ms; {path.unexplained:.0%} is unexplained."
            for path in torque_paths(record)]


def path_torque(u: np.ndarray, period: float, gain: float, lag: float, delay: float, offset: float,
                ) -> np.ndarray:
    """Torque that a path gives for a command, shape (N,)."""
    decay = np.exp(-period / max(lag, 1e-6))
    time = period * np.arange(len(u))
    lagged = lfilter([1.0 - decay], [1.0, -decay], u)
    return gain * np.interp(time - delay, time, lagged) + offset


def _fit_path(records: Sequence[Record], k: int) -> TorquePath:
    from scipy.optimize import least_squares

    commands, torques = zip(*(_torques(record, k) for record in records))
    periods = [record.sample_time for record in records]

    def error(parameters: np.ndarray) -> np.ndarray:
        return np.concatenate([path_torque(u, period, *parameters) - torque
                               for u, period, torque in zip(commands, periods, torques)])

    fits = [least_squares(error, (1.0, lag, delay, 0.0), bounds=_BOUNDS, x_scale=_SCALE)
            for lag, delay in _START_TIMES]
    best = min(fits, key=lambda fit: fit.cost)
    gain, lag, delay, offset = map(float, best.x)
    influence = block_influence(best, round(CORRELATION_TIME / periods[0]))
    of_gain, of_lag, of_delay = influence[:, 0], influence[:, 1], influence[:, 2]
    half_widths = NORMAL_95 * np.linalg.norm([of_gain, of_lag + of_delay], axis=1)
    size = np.std(np.concatenate(torques))
    return TorquePath(
        records[0].joints[k], gain, lag, delay, offset,
        unexplained=float(np.sqrt(np.mean(best.fun**2)) / (size + 1e-300)),
        half_widths=dict(zip(("gain", "total_delay"), half_widths.tolist())))


def _torques(record: Record, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Commanded and measured torque of joint k, shape (N,) each [N m]."""
    if record.u is None or record.tau is None:
        raise NotIdentifiableError(f"{record.source}: u or tau is missing; log both torques")
    return record.u[:, k], record.tau[:, k]
