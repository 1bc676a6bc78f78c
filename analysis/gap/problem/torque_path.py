"""The path of the torque from command to motor, where a log holds both.

No model of the robot is needed: the measured torque is a gain times the command, late by a delay
and a first-order lag, plus an offset.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.position_path import BLOCK, block_influence
from clie_blocks.analysis.records import Record
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import lfilter

STILL = 0.05  # share of the largest command below which a joint counts as not driven
STARTS = ((0.01, 0.003), (0.003, 0.015))  # lag and delay [s] from which a fit begins
BOUNDS = ((0.0, 0.0, 0.0, -np.inf), (5.0, 0.3, 0.2, np.inf))


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
    left : float
        RMS of what this path does not explain, over that of the measured torque.
    half_widths : dict
        Of the 95 % intervals of gain and lateness, by name.

    """

    joint: str
    gain: float
    lag: float
    delay: float
    offset: float
    left: float
    half_widths: dict[str, float]

    @property
    def late(self) -> float:
        """Time by which slow torque arrives late: lag and delay together [s]."""
        return self.lag + self.delay


def torque_paths(record: Record) -> list[TorquePath]:
    """Fit the path of each joint that is driven.

    Raises
    ------
    NotIdentifiableError
        If the record lacks one of the two, or no joint is driven.
    """
    if record.u is None or record.tau is None:
        raise NotIdentifiableError(f"{record.source} lacks u or tau: the path of the torque needs "
                                   "the commanded and the measured torque")
    driven = _driven_joints(record)
    if not driven.size:
        raise NotIdentifiableError(f"{record.source}: no joint is driven, u never changes")
    return [_path([record], k) for k in driven]


def pooled_torque_path(records: Sequence[Record], k: int) -> TorquePath | None:
    """Fit one path of joint k to all logs in which it is driven; None where there is none."""
    driven = [record for record in records if k in _driven_joints(record)]
    return _path(driven, k) if driven else None


def _driven_joints(record: Record) -> np.ndarray:
    """Joints whose command moves."""
    size = np.std(record.u, axis=0)
    return np.flatnonzero((size > 0.0) & (size > STILL * size.max()))


def describe(record: Record) -> list[str]:
    """Path of each driven joint in a sentence; nothing where the log lacks one of the torques."""
    if record.u is None or record.tau is None or not np.ptp(record.u):
        return []
    return [f"{path.joint}: the measured torque is {path.gain:.2f} times the command, "
            f"{1e3 * path.late:.0f} ms late; {path.left:.0%} is unexplained."
            for path in torque_paths(record)]


def path_torque(u: np.ndarray, period: float, gain: float, lag: float, delay: float, offset: float,
                ) -> np.ndarray:
    """Torque that a path gives for a command, shape (N,)."""
    left = np.exp(-period / max(lag, 1e-6))
    time = period * np.arange(len(u))
    return gain * np.interp(time - delay, time, lfilter([1.0 - left], [1.0, -left], u)) + offset


def _path(records: Sequence[Record], k: int) -> TorquePath:
    from scipy.optimize import least_squares

    def error(p: np.ndarray) -> np.ndarray:
        return np.concatenate([path_torque(record.u[:, k], record.sample_time, *p)
                               - record.tau[:, k] for record in records])

    fits = [least_squares(error, (1.0, lag, delay, 0.0), bounds=BOUNDS,
                          x_scale=(0.1, 0.005, 0.005, 0.01)) for lag, delay in STARTS]
    best = min(fits, key=lambda fit: fit.cost)
    pulled = block_influence(best, round(BLOCK / records[0].sample_time))
    sigmas = np.linalg.norm([pulled[:, 0], pulled[:, 1] + pulled[:, 2]], axis=1)
    size = np.std(np.concatenate([record.tau[:, k] for record in records]))
    return TorquePath(records[0].joints[k], *map(float, best.x),
                      left=float(np.sqrt(np.mean(best.fun**2)) / (size + 1e-300)),
                      half_widths=dict(zip(("gain", "late"), (1.96 * sigmas).tolist())))
