"""From set-point to motion of a servo whose law is unknown: its delay, and its dead time.

A servo needs some time to reach 5 % of a step even without any delay, and dry friction makes that
longer.  So lag, delay and friction are fitted together, and each is left out in turn: a delay of
the set-point shifts the whole motion, friction holds it back where it starts and turns.  A weight
lets the servo sag: by an offset, and by an angle that changes with the pose, here linearly.  And a
servo may go to a set-point on a course of its own, of limited acceleration and rate.

    ddq = w^2 (q_d(t - T) + offset + sag q - q - f) - 2 D w dq,  |f| <= level, f against the motion
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import zero_order_hold

if TYPE_CHECKING:
    from clie_blocks.compiled import Program

STEP_SHARE = 0.05  # of a step of the set-point: a servo that has moved so far has answered it
STEPS_PER_SAMPLE = 10  # of the simulated servo in one sample of the log
UNSETTLED_SAMPLES = 50  # at the start of a log, whose errors do not count
CORRELATION_TIME = 2.0  # s, within which errors of a fit are correlated
EXPLAINED_BY = {"lag": (), "setpoint_delay": ("delay",), "coulomb": ("level",),
                "both": ("delay", "level")}

_ANY_RATE = 1e6  # rad/s, beyond which no set-point moves
_PROMPT = 1e-6  # s^2/rad, of a servo that takes set-points as they come
_LAG = ("frequency", "damping_ratio", "offset")
_ABSENT = {"sag": 0.0, "ramp": 0.0, "rate": np.inf, "delay": 0.0, "level": 0.0}
_PARAMETERS = (*_LAG, *_ABSENT)
_START_FREQUENCIES = (15.0, 40.0)  # rad/s
_START = {"damping_ratio": 1.0, "offset": 0.0, "sag": 0.0, "level": 2e-3}
_SCALE = {"frequency": 5.0, "damping_ratio": 0.2, "offset": 0.01, "sag": 0.05, "delay": 0.01,
          "level": 2e-3}
_BOUNDS = {"frequency": (1.0, 300.0), "damping_ratio": (0.2, 5.0), "offset": (-1.0, 1.0),
           "sag": (-0.8, 0.8), "delay": (0.0, 0.3), "level": (0.0, 0.5)}


@dataclasses.dataclass(frozen=True)
class PositionPath:
    """How a servo follows its set-point.

    Parameters
    ----------
    frequency : float
        Of the servo as a second-order lag [rad/s].
    damping_ratio : float
        Of that lag.
    offset : float
        Constant error [rad].
    sag : float
        Error per angle, which the weight of a link makes [rad/rad].
    ramp : float
        One over the acceleration with which the servo itself goes to a set-point [s^2/rad].
    rate : float
        Fastest change of what it goes to [rad/s].
    delay : float
        Pure delay of set-point and reading together [s].
    level : float
        Dry friction, as the position error that just moves the servo [rad].
    rms_error : float
        RMS of the motion that this does not explain [rad].
    half_widths : dict
        Of the 95 % intervals of the fitted parameters, by name.

    """

    frequency: float
    damping_ratio: float
    offset: float
    sag: float
    ramp: float
    rate: float
    delay: float
    level: float
    rms_error: float
    half_widths: dict[str, float]


def dead_times(record: Record, k: int, least: float = 0.05, rest: int = 5) -> np.ndarray:
    """Times from each step of the set-point of joint k to 5 % of the motion [s].

    Parameters
    ----------
    record : Record
        With set-points qd and positions q.
    k : int
        Joint.
    least : float
        Smallest step of the set-point that counts [rad].
    rest : int
        Samples for which the set-point must have been constant before.

    """
    set_point, q = _set_point(record, k), record.q[:, k]
    steps = np.diff(set_point)
    times = []
    for i in np.flatnonzero(np.abs(steps) > least) + 1:
        if i < rest or steps[i - rest:i - 1].any():
            continue
        step = steps[i - 1]
        answered = np.flatnonzero(np.sign(step) * (q[i:] - q[i]) > STEP_SHARE * abs(step))
        if answered.size:
            times.append(record.time[i + answered[0]] - record.time[i])
    return np.array(times)


def fitted_and_unseen(records: Sequence[Record]) -> tuple[Record, list[Record]]:
    """The log that shows a delay best, and the others, on which fits are validated.

    It is the one whose set-points move fastest for their size; a single log is cut in two.
    """
    if len(records) == 1:
        half = len(records[0]) // 2
        return records[0].part(0, half), [records[0].part(half, len(records[0]))]
    fastest = max(records, key=_haste)
    return fastest, [record for record in records if record is not fastest]


def _haste(record: Record) -> float:
    """Mean frequency of the set-points of a log [rad/s]."""
    set_points = record.signal("qd")
    size = np.std(set_points, axis=0)
    rate = np.std(np.diff(set_points, axis=0), axis=0) / record.sample_time
    moving = size > 0.0
    return float(np.mean(rate[moving] / size[moving])) if moving.any() else 0.0


def fit_position_path(record: Record, k: int, causes: Sequence[str] = ("delay",),
                      held: Mapping[str, float] = MappingProxyType({}),
                      start: Mapping[str, float] | None = None) -> PositionPath:
    """Fit the path from set-point to motion of one joint.

    Parameters
    ----------
    record : Record
        With set-points qd and positions q on an even clock.
    k : int
        Joint.
    causes : sequence of str
        What acts in addition to the lag and is fitted: ``delay``, ``level``, ``sag``.
    held : dict
        What acts and is known, by name: ``delay``, ``ramp``, ``rate``.
    start : dict, optional
        Where the fit begins, by name; by default at a slow and at a fast servo.

    Raises
    ------
    NotIdentifiableError
        If the set-point never moves.

    """
    from scipy.optimize import least_squares

    set_point, q, period = _set_point(record, k), record.q[:, k], record.sample_time
    if np.ptp(set_point) == 0.0:
        raise NotIdentifiableError(f"{record.source}: the set-point of {record.joints[k]} never "
                                   "moves, so that its path cannot be identified")
    free = [name for name in _PARAMETERS if name in (*_LAG, *causes)]

    def parameters(vector: np.ndarray) -> dict[str, float]:
        return {**_ABSENT, **held, **dict(zip(free, map(float, vector), strict=True))}

    def error(vector: np.ndarray) -> np.ndarray:
        response = servo_response(set_point, q[0], period, **parameters(vector))
        return (response - q)[UNSETTLED_SAMPLES:]

    low, high = np.transpose([_BOUNDS[name] for name in free])
    begin = _START | {"delay": period}
    starts = ([{**begin, **start}] if start is not None else
              [begin | {"frequency": frequency} for frequency in _START_FREQUENCIES])
    fits = [least_squares(error, np.clip([one[name] for name in free], low, high),
                          x_scale=[_SCALE[name] for name in free], bounds=(low, high),
                          max_nfev=60) for one in starts]
    best = min(fits, key=lambda fit: fit.cost)
    influence = block_influence(best.jac, best.fun, round(CORRELATION_TIME / period))
    half_widths = NORMAL_95 * np.linalg.norm(influence, axis=0)
    return PositionPath(**parameters(best.x), rms_error=float(np.sqrt(np.mean(best.fun**2))),
                        half_widths=dict(zip(free, half_widths.tolist())))


def block_influence(jacobian: np.ndarray, error: np.ndarray, width: int) -> np.ndarray:
    """Influence of each block of samples on a least-squares fit, shape (blocks, parameters).

    Errors are correlated within a block and independent between blocks: the root of the sum of
    squares of a column is the standard deviation of its parameter.
    """
    blocks = range(width, len(error), width)
    gradients = np.array([rows.T @ part for rows, part in zip(
        np.split(jacobian, blocks), np.split(error, blocks))])
    return gradients @ np.linalg.pinv(jacobian.T @ jacobian)


def describe(record: Record, k: int) -> str:
    """Path of one joint in a sentence: its delay, its dry friction, and its dead time."""
    path, times = fit_position_path(record, k, ("delay", "level")), dead_times(record, k)
    path_sentence = (
        f"{record.joints[k]}: the delay of the set-points is {_with_interval(path, 'delay')} ms, "
        f"and dry friction holds up to {_with_interval(path, 'level')} mrad of error.")
    if not times.size:
        return path_sentence
    from_sample, sample = 1e3 * np.median(times), 1e3 * record.sample_time
    return (f"{path_sentence} With lag and friction the dead time is {from_sample + sample:.0f} "
            "ms, from the last reading under an old set-point to the first beyond "
            f"{100 * STEP_SHARE:.0f} % of a step ({from_sample:.0f} ms from the sample of the new "
            f"set-point; median of {times.size}).")


def _with_interval(path: PositionPath, name: str) -> str:
    """Parameter in thousandths, with the half width of its 95 % interval."""
    return f"{1e3 * getattr(path, name):.3g} +- {1e3 * path.half_widths[name]:.2g}"


def error_by_hypothesis(fitted: Record, unseen: Record, k: int,
                        ) -> dict[str, tuple[PositionPath, float]]:
    """Fitted path, and its RMS error on an unseen log [rad], by name of `EXPLAINED_BY`."""
    return {name: (path, validation_error(path, unseen, k))
            for name, path in paths_by_hypothesis(fitted, k).items()}


def paths_by_hypothesis(record: Record, k: int, names: Sequence[str] = tuple(EXPLAINED_BY),
                        ) -> dict[str, PositionPath]:
    """Fitted path of one joint, by name of `EXPLAINED_BY`: what acts in addition to the lag."""
    return {name: fit_position_path(record, k, EXPLAINED_BY[name]) for name in names}


def validation_error(path: PositionPath, record: Record, k: int) -> float:
    """RMS of what a path does not predict of a log, but for a constant [rad]."""
    return float(np.std(prediction_error(path, record, k)))


def prediction_error(path: PositionPath, record: Record, k: int) -> np.ndarray:
    """What a path does not predict of a log that has settled [rad]."""
    parameters = {name: getattr(path, name) for name in _PARAMETERS}
    response = servo_response(_set_point(record, k), record.q[0, k], record.sample_time,
                              **parameters)
    return (response - record.q[:, k])[UNSETTLED_SAMPLES:]


def _set_point(record: Record, k: int) -> np.ndarray:
    if record.qd is None:
        raise NotIdentifiableError(f"{record.source} has no set-point qd; without it the path "
                                   "from set-point to motion is unknown: log it")
    return record.qd[:, k]


def servo_response(set_point: np.ndarray, start: float, period: float, frequency: float,
                   damping_ratio: float, offset: float, delay: float, level: float = 0.0,
                   sag: float = 0.0, ramp: float = 0.0, rate: float = np.inf) -> np.ndarray:
    """Position of a servo that holds each set-point and is read with a delay, shape (N,)."""
    step = period / STEPS_PER_SAMPLE
    rates = np.array([[0.0, 1.0],
                      [(sag - 1.0) * frequency**2, -2 * damping_ratio * frequency]])
    drive = np.array([[0.0], [frequency**2]])
    a, b = zero_order_hold(rates, drive, step)
    pull = np.repeat(set_point, STEPS_PER_SAMPLE) + offset + (sag - 1.0) * start
    params = {"a": a, "b": b[:, 0], "level": np.array(level), "ramp": np.array(ramp),
              "rate": np.array(min(rate, _ANY_RATE)), "step": np.array(step)}
    outputs = _servo().run(pull.size, inputs={"q_d": pull[:, None]}, params=params,
                           initial_state=np.array([0.0, 0.0, pull[0], 0.0])).outputs
    fine = start + np.asarray(outputs).ravel()[:pull.size]
    time = step * np.arange(fine.size)
    return np.interp(period * np.arange(len(set_point)) - delay, time, fine)


@functools.cache
def _servo() -> Program:
    """Compiled step of the servo, held by dry friction where that can hold it."""
    import control as ct

    from clie_blocks.compiled import compile_diagram

    def update(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, np.ndarray],
               ) -> np.ndarray:
        (a_qq, a_qv), (a_vq, a_vv) = params["a"]
        b_q, b_v = params["b"]
        q, dq, aim, rate = x
        left, ramp, step = u[0] - aim, np.maximum(params["ramp"], _PROMPT), params["step"]
        braked = np.sign(left) * np.sqrt(2.0 * np.abs(left) / ramp)  # comes to rest there
        fastest = np.clip(braked, -params["rate"], params["rate"])
        rate = np.clip(fastest, rate - step / ramp, rate + step / ramp)
        aim = np.where(params["ramp"] > _PROMPT, aim + step * rate, aim + np.clip(
            left, -params["rate"] * step, params["rate"] * step))
        free = a_vq * q + a_vv * dq + b_v * aim
        held = np.clip(free / b_v, -params["level"], params["level"])
        return np.array([a_qq * q + a_qv * dq + b_q * (aim - held), free - b_v * held, aim, rate])

    return compile_diagram(ct.nlsys(
        update, lambda t, x, u, params: x[:1], name="servo", dt=1.0, inputs=["q_d[0]"],
        outputs=["q[0]"], states=["q", "dq", "aim", "rate"],
        params={"a": np.eye(2), "b": np.ones(2), "level": np.array(0.1), "ramp": np.array(0.01),
                "rate": np.array(1.0), "step": np.array(0.002)}))
