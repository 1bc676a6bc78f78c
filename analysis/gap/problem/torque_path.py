"""The path of the torque from command to motor, where a log holds both.

No model of the robot is needed: the measured torque is a gain times the command, after a delay
and a first-order lag, beyond a dead zone and up to a limit, plus an offset.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.position_path import CORRELATION_TIME, block_influence
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import lfilter

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

UNDRIVEN_SHARE = 0.05  # of the largest RMS command, below which a joint counts as not driven
TIMING, GAIN, LIMIT, DEAD_ZONE = "timing", "gain", "limit", "dead zone"
ELEMENTS = {TIMING: ("lag", "delay"), GAIN: ("gain",), LIMIT: ("limit",), DEAD_ZONE: ("width",)}
"""What a path may hold -> its parameters; what it does not hold is neutral."""
LINEAR = (TIMING, GAIN)
_NEUTRAL = {"gain": 1.0, "lag": 0.0, "delay": 0.0, "offset": 0.0, "limit": np.inf, "width": 0.0}
_START_TIMES = ((0.01, 0.003), (0.003, 0.015))  # lag and delay [s] from which a fit begins
_START_LIMIT = 0.95  # of the largest measured torque, from which a fit begins
_MOST_EVALUATIONS = 40  # of the path, per start
_SETTLED = 1e-6  # relative change of cost and parameters that ends a fit
_LARGEST = {"gain": 5.0, "lag": 0.3, "delay": 0.2}
_SCALE = {"gain": 0.1, "lag": 0.005, "delay": 0.005}
_SMALL = 0.05  # of the torque's spread: start of a dead zone, and scale of torques
_MAD = 0.6745  # median of the absolute value of a standard normal variable
_LEAST_NOISE = 1e-4  # of the torque's spread: a log has no more digits


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
    limit : float
        Largest torque that is given [N m]; infinite without one.
    width : float
        Command that just gives no torque [N m].
    unexplained : float
        RMS of what this path does not explain, over that of the measured torque.
    half_widths : dict
        Of the 95 % intervals of ``gain``, ``total_delay``, ``limit`` and ``width``, where fitted.
    rms_error : float
        RMS of what this path does not explain [N m].
    noise : float
        Standard deviation of the noise of the measured torque [N m].

    """

    joint: str
    gain: float
    lag: float
    delay: float
    offset: float
    unexplained: float
    half_widths: dict[str, float]
    limit: float = np.inf
    width: float = 0.0
    rms_error: float = 0.0
    noise: float = 0.0

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
    return [_fit_path([record], k, LINEAR) for k in driven]


def pooled_torque_path(records: Sequence[Record], k: int,
                       elements: Collection[str] = LINEAR) -> TorquePath | None:
    """Fit one path of joint k to all logs in which it is driven; None where there is none.

    The path holds some `ELEMENTS`.
    """
    driven = [record for record in records if k in _driven_joints(record)]
    return _fit_path(driven, k, elements) if driven else None


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
    if np.array_equal(record.u, record.tau):  # the measured torque stands for the command
        return []
    return [f"{path.joint}: the measured torque is {path.gain:.2f} times the command, with a "
            f"delay of {1e3 * path.total_delay:.0f} ms; {path.unexplained:.0%} is unexplained."
            for path in torque_paths(record)]


def path_torque(u: np.ndarray, period: float, gain: float, lag: float, delay: float, offset: float,
                limit: float = np.inf, width: float = 0.0) -> np.ndarray:
    """Torque that a path gives for a command, shape (N,)."""
    decay = np.exp(-period / max(lag, 1e-6))
    time = period * np.arange(len(u))
    lagged = lfilter([1.0 - decay], [1.0, -decay], u)
    asked = np.interp(time - delay, time, lagged)
    given = gain * (asked - np.clip(asked, -width, width))
    return np.clip(given, -limit, limit) + offset


def _fit_path(records: Sequence[Record], k: int, elements: Collection[str]) -> TorquePath:
    commands, torques = zip(*(_torques(record, k) for record in records))
    periods = [record.sample_time for record in records]
    free = [name for element in elements for name in ELEMENTS[element]] + ["offset"]

    def error(vector: np.ndarray) -> np.ndarray:
        path = {**_NEUTRAL, **dict(zip(free, vector, strict=True))}
        return np.concatenate([path_torque(u, period, **path) - torque
                               for u, period, torque in zip(commands, periods, torques)])

    measured = np.concatenate(torques)
    best = _best_fit(error, free, measured)
    influence = dict(zip(free, block_influence(
        best.jac, best.fun, round(CORRELATION_TIME / periods[0])).T))
    if TIMING in elements:
        influence["total_delay"] = influence.pop("lag") + influence.pop("delay")
    size = np.std(measured)
    rms_error = float(np.sqrt(np.mean(best.fun**2)))
    return TorquePath(
        records[0].joints[k], **{**_NEUTRAL, **dict(zip(free, map(float, best.x), strict=True))},
        unexplained=float(rms_error / (size + 1e-300)), rms_error=rms_error,
        noise=max(_noise(torques), _LEAST_NOISE * float(size)),
        half_widths={name: float(NORMAL_95 * np.linalg.norm(column))
                     for name, column in influence.items()})


def _best_fit(error: Callable[[np.ndarray], np.ndarray], free: Sequence[str],
              measured: np.ndarray) -> OptimizeResult:
    """Best of the fits from several starts."""
    from scipy.optimize import least_squares

    size, largest = float(np.std(measured)) + 1e-300, float(np.abs(measured).max()) + 1e-300
    bounds = [(-np.inf if name == "offset" else 0.0, _LARGEST.get(name, np.inf)) for name in free]
    fits = []
    for lag, delay in _START_TIMES if "lag" in free else ((0.0, 0.0),):
        start = {**_NEUTRAL, "lag": lag, "delay": delay, "limit": _START_LIMIT * largest,
                 "width": _SMALL * size}
        fits.append(least_squares(
            error, [start[name] for name in free], bounds=tuple(zip(*bounds)),
            x_scale=[_SCALE.get(name, _SMALL * size) for name in free],
            max_nfev=_MOST_EVALUATIONS, ftol=_SETTLED, xtol=_SETTLED))
    return min(fits, key=lambda fit: fit.cost)


def _noise(torques: Sequence[np.ndarray]) -> float:
    """Standard deviation of white noise, from second differences, which no slow torque has."""
    second = np.concatenate([np.diff(torque, 2) for torque in torques])
    return float(np.median(np.abs(second)) / (_MAD * np.sqrt(6.0)))


def _torques(record: Record, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Commanded and measured torque of joint k, shape (N,) each [N m]."""
    if record.u is None or record.tau is None:
        raise NotIdentifiableError(f"{record.source}: u or tau is missing; log both torques")
    return record.u[:, k], record.tau[:, k]
