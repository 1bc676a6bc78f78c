"""The delay of a servo's set-points, and steps of its positions, before any model of the joint.

A nominal servo acts on its set-point at once.  The odds of the verdict tell whether a delay is
needed: lag alone, lag with delay, lag with dry friction, and lag with both are validated on logs
that they were not fitted to.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.problem import position_path
from clie_blocks.analysis.gap.problem.position_path import PositionPath
from clie_blocks.analysis.gap.problem.servo_delay import shows_delay
from clie_blocks.analysis.gap.residual.noise import Noise
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import LIKELY, of_known, posterior
from clie_blocks.analysis.gap.verdict.signal_finding import Entry, SignalFinding, entry
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95

_HYPOTHESES = {"setpoint_delay": ("time_delay",), "coulomb": ("coulomb",),
               "both": ("coulomb", "time_delay")}
_WITH_DELAY = ("setpoint_delay", "both")


def set_point_delay(records: Sequence[Record], residuals: ResidualModel,
                    left_out: Collection[str]) -> tuple[SignalFinding, ...]:
    """The delay of the set-points of those servos where the odds are for one."""
    names = ["lag", *(name for name, causes in _HYPOTHESES.items()
                      if not set(causes) & set(left_out))]
    if not any(name in _WITH_DELAY for name in names):
        return ()
    fitted, unseen = position_path.fitted_and_unseen(records)
    moving = np.flatnonzero(np.ptp(fitted.signal("qd"), axis=0) > 0).tolist()
    seen = [_delayed_joint(fitted, unseen, k, names, residuals) for k in moving]
    late = [one for one in seen if one is not None]
    if not late:
        return ()
    joints = tuple(one.joint for one in late)
    left = {name: np.array([one.left[name] for one in late]) for name in names}
    times = {"delay": _delays([one.path for one in late])}
    dead_times = [position_path.dead_times(fitted, k) for k in joints]
    if all(times_of.size for times_of in dead_times):
        times["dead_time"] = _dead_times(dead_times, fitted.sample_time)
    share = _share(_excess(left, [residuals.noises[k] for k in joints]))
    return (SignalFinding("time_delay", joints, min(one.probability for one in late), times,
                          share, left),)


def coarse_positions(residuals: ResidualModel, check: ControllerCheck) -> Iterator[SignalFinding]:
    """Steps of the position, where no file states them and they make most of the noise."""
    method = residuals.method.verdict
    sigma = np.array([noise.sigma for noise in residuals.noises])
    is_coarse = ((residuals.problem.resolution == 0)
                 & (check.step / np.sqrt(12.0) > method.quantization_share * sigma))
    joints = np.flatnonzero(is_coarse)
    if joints.size:
        yield SignalFinding("encoder_quantization", tuple(joints.tolist()), method.certain,
                            {"step": entry(check.step[joints], "rad")})


class _DelayedJoint(NamedTuple):
    """A servo whose set-points are delayed, and what each explanation leaves of its motion."""

    joint: int
    probability: float
    path: PositionPath
    left: dict[str, float]


def _delayed_joint(fitted: Record, unseen: Sequence[Record], k: int, names: Sequence[str],
                   residuals: ResidualModel) -> _DelayedJoint | None:
    """Delay of the set-points of one servo, where the odds are for one."""
    paths = position_path.paths_by_hypothesis(fitted, k, names)
    left = {name: _validation_rms(unseen, k, paths[name]) for name in names}
    excess = _excess({name: np.array([rms]) for name, rms in left.items()}, [residuals.noises[k]])
    probability = delay_probability(excess, residuals.method.calibration)
    if probability >= LIKELY:
        best = min((name for name in names if name in _WITH_DELAY), key=lambda name: excess[name])
        return _DelayedJoint(k, probability, paths[best], left)
    if not shows_delay(fitted, k):
        return None
    path = position_path.fit_position_path(fitted, k, ("delay", "level", "sag"))
    return _DelayedJoint(k, residuals.method.verdict.delay_of_servo, path, left)


def _validation_rms(records: Sequence[Record], k: int, path: PositionPath) -> float:
    """RMS error of a fitted path of joint k over some logs [rad]."""
    return float(np.sqrt(np.mean([position_path.validation_error(path, record, k)**2
                                  for record in records])))


def _excess(left: Mapping[str, np.ndarray], noises: Sequence[Noise]) -> dict[str, float]:
    """chi^2 beyond the noise, per sample of one joint, of what each explanation leaves [rad]."""
    sigma = np.array([noise.sigma for noise in noises])
    return {name: float(np.sum(rms**2 / sigma**2 - 1.0)) for name, rms in left.items()}


def delay_probability(excess: Mapping[str, float], calibration: Calibration) -> float:
    """Probability that set-points are delayed, from what each explanation leaves.

    Whether something else may be at work, too, is a question to the motion.  `excess` is chi^2
    beyond the noise, per sample of one joint, by name of `position_path.EXPLAINED_BY`; a name
    that is missing is no explanation.
    """
    rows = [Row(causes, excess[name], float(len(causes)))
            for name, causes in _HYPOTHESES.items() if name in excess]
    known = of_known(posterior(Table(excess["lag"], 0.0, 0, (), rows), calibration))
    return sum(ranked.probability for ranked in known if "time_delay" in ranked.names)


def _share(excess: Mapping[str, float]) -> float:
    """Share of the gap that the delay removes, on average without and with the dry friction."""
    gains = [excess[without] - excess[delayed] for without, delayed in (
        ("lag", "setpoint_delay"), ("coulomb", "both")) if delayed in excess]
    return float(np.clip(np.mean(gains) / excess["lag"], 0.0, 1.0))


def _delays(paths: Sequence[PositionPath]) -> Entry:
    value, half = np.transpose([(path.delay, path.half_widths["delay"]) for path in paths])
    return entry(value, "s", np.maximum(value - half, 0.0), value + half)


def _dead_times(by_joint: Sequence[np.ndarray], sample_time: float) -> Entry:
    """Median time from the last reading under an old set-point, with a 95 % interval.

    The motion began between two readings, so the interval begins one sample earlier.
    """
    value = np.array([np.median(times) for times in by_joint])
    low, high = np.transpose([_median_interval(np.sort(times)) for times in by_joint])
    return entry(value + sample_time, "s", low, high + sample_time)


def _median_interval(ordered: np.ndarray) -> tuple[float, float]:
    """95 % interval of the median of a population, from an ordered sample."""
    half = NORMAL_95 / 2 * np.sqrt(ordered.size)  # of the rank of the median
    first, last = (ordered.size - 1) / 2 + np.array([-half, half])
    return ordered[max(int(np.floor(first)), 0)], ordered[min(int(np.ceil(last)),
                                                              ordered.size - 1)]
