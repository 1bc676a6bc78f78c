"""Causes that the command path shows by itself, before any model of the joint is fitted.

A nominal servo acts on its set-point at once, a nominal drive gives the torque that is commanded.
Where a log holds both ends of that path, what lies between them is measured, and is reported with
the causes that the motion is searched for.  For a set-point the odds of the verdict tell whether
a delay is needed: lag alone, lag with delay, lag with dry friction, and lag with both are
validated on logs that they were not fitted to.
"""

import dataclasses
import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from clie_blocks.analysis.gap.controller.named import NamedJoint
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.controller.terms import Terms
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem import position_path, torque_path
from clie_blocks.analysis.gap.problem.position_path import PositionPath
from clie_blocks.analysis.gap.problem.servo_delay import shows_delay
from clie_blocks.analysis.gap.problem.torque_path import TorquePath
from clie_blocks.analysis.gap.residual.noise import Noise
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    UNKNOWN,
    RankedCause,
    marginals,
    posterior,
)
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import MEASURED
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.effects import LIBRARY

_HYPOTHESES = {"setpoint_delay": ("time_delay",), "coulomb": ("coulomb",),
               "both": ("coulomb", "time_delay")}
_WITH_DELAY = ("setpoint_delay", "both")
_DRIVE_EFFECTS = {torque_path.TIMING: ("actuator_lag", "time_delay"),
                  torque_path.GAIN: ("torque_gain_error",),
                  torque_path.LIMIT: ("actuator_saturation",),
                  torque_path.DEAD_ZONE: ("dead_zone",)}
_DRIVE_PARAMETERS = {"actuator_lag": ("lag", "s"), "time_delay": ("delay", "s"),
                     "torque_gain_error": ("error", "1"), "actuator_saturation": ("limit", "N m"),
                     "dead_zone": ("width", "N m")}
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
    members : tuple of str
        All names that explain these logs alike, `effect` being the first; empty for one alone.

    """

    effect: str
    joints: tuple[int, ...]
    probability: float
    parameters: dict[str, Entry]
    share: float = 0.0
    left: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    members: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Row of the JSON answer."""
        row = {"effect": self.effect, "joint": [k + 1 for k in self.joints],
               "probability": self.probability, "parameters": self.parameters}
        return {**row, "members": list(self.members)} if self.members else row


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
    elif all(is_driven_by_error(record) for record in records):
        findings = _coarse_positions(residuals, check)
    elif all(findings_of_torque_path(record) for record in records):
        findings = _drive_findings(records, residuals.method, left_out)
    return tuple(finding for finding in findings if finding.effect not in left_out)


def controller_findings(check: ControllerCheck, method: VerdictMethod,
                         left_out: Collection[str] = frozenset()) -> tuple[SignalFinding, ...]:
    """Causes that the check of the controller establishes, but for those that are left out.

    They are the velocity filter that ran, the steps that the encoder makes, the age of a measured
    torque, and the effects with which the stated law gives the logged commands.  Those that do so
    alike are one finding.
    """
    other, coarse = list(check.other_filter), list(check.coarse)
    lag, every = check.torque_lag, tuple(range(len(check.limit)))
    late = every if lag is not None and lag.is_skew else ()
    findings = (
        SignalFinding("velocity_filter_mismatch", check.other_filter, method.certain,
                      {"highpass": _entry(check.corners[0, other], "rad/s"),
                       "lowpass": _entry(check.corners[1, other], "rad/s")}),
        SignalFinding("encoder_quantization", check.coarse, method.certain,
                      {"step": _entry(check.step[coarse], "rad")}),
        SignalFinding("channel_skew", late, method.certain,
                      {"skew": _entry(np.full(len(late), lag.age if lag else 0.0), "s")}))
    established = (finding for finding in findings
                   if finding.joints and finding.effect not in left_out)
    return (*established, *_named_findings(check.named, method, left_out),
            *_findings_of_terms(check.terms, method, left_out))


def _findings_of_terms(terms: Sequence[Terms], method: VerdictMethod,
                       left_out: Collection[str]) -> Iterator[SignalFinding]:
    """Effects that are a term of the law, with the joints whose commands hold it."""
    for name in sorted({one.effect for one in terms if one.effect} - set(left_out)):
        same = [one for one in terms if one.effect == name]
        units = {p.name: p.unit for p in LIBRARY[name].parameters}
        yield SignalFinding(name, tuple(one.joint for one in same), method.certain, {
            key: _entry(np.array([one.parameters[key] for one in same]), units[key])
            for key in same[0].parameters})


def _named_findings(named: Sequence[NamedJoint], method: VerdictMethod,
                    left_out: Collection[str]) -> Iterator[SignalFinding]:
    """Effects that explain commands, with the joints at which the same ones do."""
    by_names: dict[tuple[str, ...], list[NamedJoint]] = {}
    for one in named:
        names = tuple(sorted(name for name in one.names if name not in left_out))
        if names:
            by_names.setdefault(names, []).append(one)
    for names, joints in by_names.items():
        yield _named_finding(names, joints, method)


def _named_finding(names: tuple[str, ...], joints: Sequence[NamedJoint], method: VerdictMethod,
                   ) -> SignalFinding:
    first = next(name for name in joints[0].names if name in names)
    fits = [one for joint in joints for one in joint.found if one.name == first]
    parameters = {}
    for key in dict.fromkeys(key for one in fits for key in one.values):
        value, half = (np.array([getattr(one, part).get(key, 0.0) for one in fits])
                       for part in ("values", "half"))
        bound = fits[0].candidate.parameter(key)
        parameters[key] = _entry(value, bound.unit, np.maximum(value - half, bound.lower),
                                 np.minimum(value + half, bound.upper))
    members = (first, *(name for name in names if name != first)) if len(names) > 1 else ()
    return SignalFinding(first, tuple(joint.joint for joint in joints), method.certain,
                         parameters, members=members)


def with_signal_findings(verdict: str, findings: Sequence[SignalFinding]) -> str:
    """Verdict on the robot, from that on the motion and from what the command path shows."""
    return "effect" if findings and verdict in ("none", "not_identifiable") else verdict


def findings_of_position_path(record: Record) -> bool:
    """Whether a position error in rad stands for a command that was not logged.

    Where links show its torque, the motion tells a delay: the path of one joint knows no coupling.
    """
    law = record.robot and record.robot.controller
    return bool(law and is_driven_by_error(record) and np.all(law.kp == 1.0))


def is_driven_by_error(record: Record) -> bool:
    """Whether the position error, or the torque it is worth, stands for the command."""
    law = record.robot and record.robot.controller
    return bool(law and _has_no_law(record) and record.u is not None and record.qd is not None
                and np.array_equal(record.u, (record.qd - record.q) * law.kp))


def findings_of_torque_path(record: Record) -> bool:
    """Whether commands act as excitation, and the torque that came of them was measured."""
    law = record.robot and record.robot.controller
    return bool(law and _has_no_law(record) and law.u_is != MEASURED and record.u is not None
                and record.tau is not None and not np.any(law.kp))


def _has_no_law(record: Record) -> bool:
    """Whether the stated law stands in for an unknown one."""
    law = record.robot and record.robot.controller
    return bool(law and law.velocity_filter == "difference" and law.kd is not None
                and not np.any(law.kd))


def _setpoint_delay(records: Sequence[Record], residuals: ResidualModel,
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
    known = _of_known(posterior(Table(excess["lag"], 0.0, 0, (), rows), calibration))
    return sum(ranked.probability for ranked in known if "time_delay" in ranked.names)


def _of_known(ranking: Sequence[RankedCause]) -> list[RankedCause]:
    """Ranking without `unknown`."""
    known = [ranked for ranked in ranking if ranked.names != (UNKNOWN,)]
    held = sum(ranked.probability for ranked in known)
    return [dataclasses.replace(ranked, probability=ranked.probability / held)
            for ranked in known]


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


def _drive_findings(records: Sequence[Record], method: Method, left_out: Collection[str],
                    ) -> Iterator[SignalFinding]:
    """Delay, gain, limit and dead zone of the drives whose torque is measured."""
    by_effect: dict[str, list[_Shown]] = {}
    for k in range(records[0].n):
        for shown in _of_drive(records, k, method, left_out):
            by_effect.setdefault(shown.effect, []).append(shown)
    for effect, rows in by_effect.items():
        _, joints, probability, value, half = map(np.array, zip(*rows))
        name, unit = _DRIVE_PARAMETERS[effect]
        yield SignalFinding(effect, tuple(joints.tolist()), float(probability.min()),
                            {name: _entry(value, unit, value - half, value + half)})


class _Shown(NamedTuple):
    """An effect of one drive, with its parameter and the half width of its interval."""

    effect: str
    joint: int
    probability: float
    value: float
    half: float


def _of_drive(records: Sequence[Record], k: int, method: Method, left_out: Collection[str],
              ) -> list[_Shown]:
    """Effects of one drive that are likely.

    The odds of the verdict tell which of the elements a path needs.  They count as far as paths
    explain at all what is measured beyond the command: the rest is something else, of which what
    was found may be but the image.
    """
    paths = _paths_of_drive(records, k, method.verdict)
    if not paths:
        return []
    excess = {held: (path.rms_error / path.noise) ** 2 - 1.0 for held, path in paths.items()}
    rows = [Row(held, left, float(len(held))) for held, left in excess.items() if held]
    known = marginals(_of_known(posterior(Table(excess[()], 0.0, 0, (), rows),
                                          method.calibration)))
    explained = 1.0 - max(min(excess.values()), 0.0) / max(excess[()], method.calibration.floor)
    odds = {name: explained * probability for name, probability in known.items()}
    likely = tuple(element for element in torque_path.ELEMENTS if odds.get(element, 0.0) >= LIKELY)
    return [_shown(paths[likely], element, k, odds[element], left_out) for element in likely
            if not set(_DRIVE_EFFECTS[element]) <= set(left_out)]


def _paths_of_drive(records: Sequence[Record], k: int, method: VerdictMethod,
                    ) -> dict[tuple[str, ...], TorquePath]:
    """Paths by the elements that they hold, for all sets of those that act at all."""
    whole = torque_path.pooled_torque_path(records, k, tuple(torque_path.ELEMENTS))
    if whole is None:
        return {}
    acting = [element for element in torque_path.ELEMENTS
              if _acts(whole, element, records[0].sample_time, method)]
    sets = itertools.chain.from_iterable(
        itertools.combinations(acting, count) for count in range(len(acting) + 1))
    paths = {held: torque_path.pooled_torque_path(records, k, held) for held in sets}
    return {held: path for held, path in paths.items() if path is not None}


def _acts(path: TorquePath, element: str, period: float, method: VerdictMethod) -> bool:
    """Whether an element of a fitted path differs from what a sound drive has."""
    half = path.half_widths
    if element == torque_path.TIMING:
        return path.total_delay - half["total_delay"] > period
    if element == torque_path.GAIN:
        return abs(path.gain - 1.0) > max(half["gain"], method.gain_error)
    if element == torque_path.LIMIT:
        return 0.0 < half["limit"] < path.limit
    return path.width > half["width"] > 0.0


def _shown(path: TorquePath, element: str, k: int, probability: float,
           left_out: Collection[str]) -> _Shown:
    """Effect that an element of a path is."""
    effects = [name for name in _DRIVE_EFFECTS[element] if name not in left_out]
    if element == torque_path.TIMING:
        effect = effects[0] if path.lag > path.delay else effects[-1]
        return _Shown(effect, k, probability, path.total_delay, path.half_widths["total_delay"])
    value = {torque_path.GAIN: path.gain - 1.0, torque_path.LIMIT: path.limit,
             torque_path.DEAD_ZONE: path.width}[element]
    parameter = {torque_path.GAIN: "gain", torque_path.LIMIT: "limit"}.get(element, "width")
    return _Shown(effects[0], k, probability, value, path.half_widths[parameter])


def _entry(value: np.ndarray, unit: str, low: np.ndarray | None = None,
           high: np.ndarray | None = None) -> Entry:
    return {"value": value, "unit": unit, "interval": None if low is None else [low, high]}
