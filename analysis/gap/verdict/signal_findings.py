"""Causes that the command path shows by itself, before any model of the joint is fitted.

A nominal servo acts on its set-point at once, a nominal drive gives the torque that is commanded.
Where a log holds both ends of that path, what lies between them is measured, and is reported with
the causes that the motion is searched for.  For a set-point the odds of the verdict tell whether
a delay is needed: lag alone, lag with delay, lag with dry friction, and lag with both are
validated on logs that they were not fitted to.
"""

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem import position_path, torque_path
from clie_blocks.analysis.gap.problem.position_path import PositionPath
from clie_blocks.analysis.gap.residual.noise import Noise
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import LIKELY, UNKNOWN, posterior
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95

_HYPOTHESES = {"setpoint_delay": ("time_delay",), "coulomb": ("coulomb",),
               "both": ("coulomb", "time_delay")}
_WITH_DELAY = ("setpoint_delay", "both")
Entry = dict[str, Any]
"""A parameter in the answer: ``value``, ``unit`` and ``interval``, an entry per joint."""


@dataclasses.dataclass(frozen=True, eq=False)
class SignalFinding:
    """A cause that lies on the command path.

    Parameters
    ----------
    effect : str
        Name in the vocabulary.
    joints : tuple of int
        Where it was found.
    probability : float
        Of the cause.
    parameters : dict
        Parameter -> ``value``, ``unit`` and ``interval``, an entry per joint.
    share : float
        Of the gap, where that is known.
    left : dict
        What each explanation leaves of each joint's motion [rad]: arrays by name of
        `position_path.EXPLAINED_BY`.

    """

    effect: str
    joints: tuple[int, ...]
    probability: float
    parameters: dict[str, Entry]
    share: float = 0.0
    left: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Row of the JSON answer."""
        return {"effect": self.effect, "joint": [k + 1 for k in self.joints],
                "probability": self.probability, "parameters": self.parameters}


def signal_findings(records: Sequence[Record], residuals: ResidualModel, check: ControllerCheck,
                    left_out: Collection[str] = frozenset()) -> tuple[SignalFinding, ...]:
    """Causes on the command path; none where the law is stated and its command logged.

    Parameters
    ----------
    records : list of Record
        Logs as `preparation.prepare` gives them.
    residuals : ResidualModel
        Noise of the joints.
    check : ControllerCheck
        Steps of the logged positions.
    left_out : set of str
        Effects that are known not to be there: none is named, none explains a motion.

    """
    findings: Iterable[SignalFinding] = ()
    if all(findings_of_position_path(record) for record in records):
        findings = (*_setpoint_delay(records, residuals, left_out),
                    *_coarse_positions(residuals, check))
    elif all(findings_of_torque_path(record) for record in records):
        findings = _drive_findings(records, residuals.method.verdict, left_out)
    return tuple(finding for finding in findings if finding.effect not in left_out)


def controller_findings(check: ControllerCheck, method: VerdictMethod,
                         left_out: Collection[str] = frozenset()) -> tuple[SignalFinding, ...]:
    """Causes that the check of the controller establishes, but for those that are left out.

    They are the velocity filter that ran, and the steps that the encoder makes.
    """
    other, coarse = list(check.other_filter), list(check.coarse)
    findings = (
        SignalFinding("velocity_filter_mismatch", check.other_filter, method.certain,
                      {"highpass": _entry(check.corners[0, other], "rad/s"),
                       "lowpass": _entry(check.corners[1, other], "rad/s")}),
        SignalFinding("encoder_quantization", check.coarse, method.certain,
                      {"step": _entry(check.step[coarse], "rad")}))
    return tuple(finding for finding in findings
                 if finding.joints and finding.effect not in left_out)


def with_signal_findings(verdict: str, findings: Sequence[SignalFinding]) -> str:
    """Verdict on the robot, from that on the motion and from what the command path shows."""
    return "effect" if findings and verdict in ("none", "not_identifiable") else verdict


def findings_of_position_path(record: Record) -> bool:
    """Whether the position error stands for a command that was not logged."""
    return (_has_no_law(record) and record.u is not None and record.qd is not None
            and np.array_equal(record.u, record.qd - record.q))


def findings_of_torque_path(record: Record) -> bool:
    """Whether commands act as excitation, and the torque that came of them was measured."""
    law = record.robot and record.robot.controller
    return bool(law and _has_no_law(record) and record.u is not None
                and record.tau is not None and not np.any(law.kp))


def _has_no_law(record: Record) -> bool:
    """Whether the stated law stands in for an unknown one."""
    law = record.robot and record.robot.controller
    return bool(law and law.velocity_filter == "difference" and law.kd is not None
                and not np.any(law.kd))


def _setpoint_delay(records: Sequence[Record], residuals: ResidualModel,
                    left_out: Collection[str]) -> tuple[SignalFinding, ...]:
    """The delay of a servo's set-points, where the odds are for one."""
    names = ["lag", *(name for name, causes in _HYPOTHESES.items()
                      if not set(causes) & set(left_out))]
    with_delay = [name for name in names if name in _WITH_DELAY]
    reference = records[0].qd
    if reference is None:
        return ()
    joints = tuple(int(k) for k in np.flatnonzero(np.ptp(reference, axis=0) > 0))
    if not joints or not with_delay:
        return ()
    paths = [position_path.paths_by_hypothesis(records[0], k, names) for k in joints]
    unseen = records[1:] or records
    left = {name: np.array([_validation_rms(unseen, k, by_name[name])
                            for k, by_name in zip(joints, paths)]) for name in names}
    excess = _excess(left, [residuals.noises[k] for k in joints])
    probability = delay_probability(excess, residuals.method.calibration)
    if probability < LIKELY:
        return ()
    best = min(with_delay, key=lambda name: excess[name])
    times = {"time": _delays([by_name[best] for by_name in paths])}
    dead_times = [position_path.dead_times(records[0], k) for k in joints]
    if all(times_of.size for times_of in dead_times):
        times["dead_time"] = _dead_times(dead_times, records[0].sample_time)
    return (SignalFinding("time_delay", joints, probability, times, _share(excess), left),)


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
    known = [ranked for ranked in posterior(Table(excess["lag"], 0.0, 0, (), rows), calibration)
             if ranked.names != (UNKNOWN,)]
    delayed = sum(ranked.probability for ranked in known if "time_delay" in ranked.names)
    return delayed / sum(ranked.probability for ranked in known)


def _share(excess: Mapping[str, float]) -> float:
    """Share of the gap that the delay removes, on average without and with the dry friction."""
    gains = [excess[without] - excess[delayed] for without, delayed in (
        ("lag", "setpoint_delay"), ("coulomb", "both")) if delayed in excess]
    return float(np.clip(np.mean(gains) / excess["lag"], 0.0, 1.0))


def _delays(paths: Sequence[PositionPath]) -> Entry:
    value, half = np.transpose([(path.delay, path.half_widths["delay"]) for path in paths])
    return _entry(value, "s", np.maximum(value - half, 0.0), value + half)


def _dead_times(by_joint: Sequence[np.ndarray], sample_time: float) -> Entry:
    """Median time from the last reading under an old set-point, with a 95 % interval.

    The motion began between two readings, so the interval begins one sample earlier.
    """
    value = np.array([np.median(times) for times in by_joint])
    low, high = np.transpose([_median_interval(np.sort(times)) for times in by_joint])
    return _entry(value + sample_time, "s", low, high + sample_time)


def _median_interval(ordered: np.ndarray) -> tuple[float, float]:
    """95 % interval of the median of a population, from an ordered sample."""
    half = NORMAL_95 / 2 * np.sqrt(ordered.size)  # of the rank of the median
    first, last = (ordered.size - 1) / 2 + np.array([-half, half])
    return ordered[max(int(np.floor(first)), 0)], ordered[min(int(np.ceil(last)),
                                                              ordered.size - 1)]


def _coarse_positions(residuals: ResidualModel, check: ControllerCheck) -> Iterator[SignalFinding]:
    """Steps of the position, where no file states them and they make most of the noise."""
    method = residuals.method.verdict
    sigma = np.array([noise.sigma for noise in residuals.noises])
    is_coarse = ((residuals.problem.resolution == 0)
                 & (check.step / np.sqrt(12.0) > method.quantization_share * sigma))
    joints = np.flatnonzero(is_coarse)
    if joints.size:
        yield SignalFinding("encoder_quantization", tuple(joints.tolist()), method.certain,
                            {"step": _entry(check.step[joints], "rad")})


def _drive_findings(records: Sequence[Record], method: VerdictMethod, left_out: Collection[str],
                    ) -> Iterator[SignalFinding]:
    """Lag or delay, and gain, of the drives whose torque is measured."""
    timing = [name for name in ("actuator_lag", "time_delay") if name not in left_out]
    by_effect: dict[str, list[tuple[int, float, float]]] = {
        "actuator_lag": [], "time_delay": [], "torque_gain_error": []}
    for k in range(records[0].n):
        path = torque_path.pooled_torque_path(records, k)
        if path is None:
            continue
        if timing and path.total_delay - path.half_widths["total_delay"] > records[0].sample_time:
            by_effect[timing[0] if path.lag > path.delay else timing[-1]].append(
                (k, path.total_delay, path.half_widths["total_delay"]))
        if abs(path.gain - 1.0) > max(path.half_widths["gain"], method.gain_error):
            by_effect["torque_gain_error"].append((k, path.gain - 1.0, path.half_widths["gain"]))
    for effect, rows in by_effect.items():
        if rows:
            joints, value, half = map(np.array, zip(*rows))
            name, unit = ("error", "1") if effect == "torque_gain_error" else ("time", "s")
            yield SignalFinding(effect, tuple(joints.tolist()), method.certain,
                                {name: _entry(value, unit, value - half, value + half)})


def _entry(value: np.ndarray, unit: str, low: np.ndarray | None = None,
           high: np.ndarray | None = None) -> Entry:
    return {"value": value, "unit": unit, "interval": None if low is None else [low, high]}
