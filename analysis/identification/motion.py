"""Filtered motion of a record: what regressions need and no sensor gives.

All signals of a run pass the same zero-phase low-pass, so that the equation of motion stays true
between them; the position alone is filtered once more, and wider, before it is differentiated.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.identification.signals_of_log import command, robot_of
from clie_blocks.analysis.records.checks.measures import centres, half_width, smooth_motion
from clie_blocks.analysis.records.control_law import gains
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.runs import runs
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import low_pass

BAND = 2.0  # regression band over the natural frequency of the loop
MOTION_BAND = 4.0  # and over the mean frequency of the motion
SMOOTH = 0.1  # s
WIDER = 2.5  # band of the position over that of the regression
LEAST_SAMPLES = 200
STICTION_SPEED = 0.01  # of the top speed, over which dry friction turns its sign


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """One unbroken run of a record, with its motion.

    Parameters
    ----------
    record : Record
        The run alone, all samples valid.
    step : float
        Sample time [s].
    q, dq, ddq : ndarray, shape (N, n)
        Zero-phase filtered position and its derivatives.
    inner : slice
        Samples away from the ends, where the filters are good.
    every : int
        Stride at which low-passed signals are independent.
    bands : ndarray, shape (n,)
        Band of the regression [Hz].

    """

    record: Record
    step: float
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    inner: slice
    every: int
    bands: np.ndarray

    def lowpassed(self, x: np.ndarray, k: int) -> np.ndarray:
        """Signal in the band of the regression of joint k, thinned to independent samples."""
        return _lowpass(x, self.bands[k], self.step)[self.inner][::self.every]


def split(records: Sequence[Record], inertia: np.ndarray) -> list[Run]:
    """Unbroken runs of some logs of one robot, long enough to identify from.

    Parameters
    ----------
    records : sequence of Record
        Logs of one robot.
    inertia : ndarray, shape (n,)
        Rough inertia [u per rad/s^2]; sets the band of the filters together with the gains.

    Raises
    ------
    NotIdentifiableError
        If no run is long enough.

    """
    unbroken = [whole(record.part(start, stop), inertia) for record in records
                for start, stop in runs(record, LEAST_SAMPLES)]
    if not unbroken:
        raise NotIdentifiableError(f"{records[0].source} has no unbroken run of {LEAST_SAMPLES} "
                                   "samples; repair the gaps or log longer")
    return unbroken


def natural_frequency(controller: Controller, inertia: np.ndarray) -> np.ndarray:
    """Natural frequency of the loop [Hz], or zero where the law is unknown."""
    if controller.law == "unknown":
        return np.zeros(len(inertia))
    return np.sqrt(gains(controller)[0] / inertia) / (2 * np.pi)


def rough_inertia(record: Record) -> np.ndarray:
    """Inertia of each joint from the balance of momentum, ``int u = J dq + F q + c t + b``, (n,).

    It needs no acceleration, hence no filter; friction and load only blur it.
    """
    return np.array([_momentum_inertia(record, k) for k in range(record.n)])


def stiction(dq: np.ndarray, top_speed: float) -> np.ndarray:
    """Direction of dry friction, smoothed below a hundredth of the top speed."""
    return np.tanh(dq / (STICTION_SPEED * top_speed))


def _momentum_inertia(record: Record, k: int) -> float:
    start, stop = max(runs(record), key=lambda run: run[1] - run[0], default=(0, len(record)))
    step, q, u = record.sample_time, record.q[start:stop, k], command(record)[start:stop, k]
    time = np.arange(stop - start) * step
    columns = np.column_stack((np.gradient(q, step), q, time, np.ones_like(time)))
    momentum = np.cumsum(u) * step
    return max(abs(np.linalg.lstsq(columns, momentum, rcond=None)[0][0]), 1e-12)


def whole(part: Record, inertia: np.ndarray) -> Run:
    """One run of all samples of a record, each of which must be valid."""
    step = part.sample_time
    loop = natural_frequency(robot_of(part).controller, inertia)
    bands = np.maximum(BAND * loop, MOTION_BAND * _mean_frequency(part))
    bands = np.clip(bands, 5 / part.duration, 0.1 / step)
    q = _lowpass_each(part.q, WIDER * bands, step)
    dq = np.gradient(q, step, axis=0)
    edge = int(min(1.0 / (bands.min() * step), len(part) / 10))
    return Run(part, step, q, dq, np.gradient(dq, step, axis=0),
               slice(edge, len(part) - edge), max(1, int(0.2 / (bands.max() * step))), bands)


def _mean_frequency(part: Record) -> np.ndarray:
    """Mean frequency of the motion [Hz], seen through windows that keep the noise out."""
    width = half_width(part, SMOOTH)
    _, dq, ddq = smooth_motion(part, centres(part, width), width)
    return np.sqrt(np.mean(ddq**2, axis=0)
                   / np.maximum(np.mean(dq**2, axis=0), 1e-300)) / (2 * np.pi)


def _lowpass_each(x: np.ndarray, bands: np.ndarray, step: float) -> np.ndarray:
    return np.stack([_lowpass(x[:, k], band, step) for k, band in enumerate(bands)], axis=1)


def _lowpass(x: np.ndarray, band: float, step: float) -> np.ndarray:
    """Butterworth of order 4, run forwards and backwards, so that nothing is shifted."""
    return low_pass(x, 4, min(band * step, 0.45), 1.0)
