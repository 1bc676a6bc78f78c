"""Causes that the command path shows by itself, before any model of the joint is fitted.

A nominal servo acts on its set-point at once, a nominal drive gives the torque that is commanded.
Where a log holds both ends of that path, what lies between them is measured, and is reported with
the causes that the motion is searched for.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.named import NamedJoint
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.controller.terms import Terms
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem.counted_positions import can_read_between_counts
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.drive_findings import drive_findings
from clie_blocks.analysis.gap.verdict.set_point_findings import coarse_positions, set_point_delay
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding, entry
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import MEASURED
from clie_blocks.effects import LIBRARY

_COARSE = "encoder_quantization"


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
        findings = (*set_point_delay(records, residuals, left_out),
                    *coarse_positions(residuals, check))
    elif all(is_driven_by_error(record) for record in records):
        findings = coarse_positions(residuals, check)
    elif all(findings_of_torque_path(record) for record in records):
        findings = drive_findings(records, residuals.method, left_out)
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
                      {"highpass": entry(check.corners[0, other], "rad/s"),
                       "lowpass": entry(check.corners[1, other], "rad/s")}),
        SignalFinding(_COARSE, check.coarse, method.certain,
                      {"step": entry(check.step[coarse], "rad")}),
        SignalFinding("channel_skew", late, method.certain,
                      {"skew": entry(np.full(len(late), lag.age if lag else 0.0), "s")}))
    established = (finding for finding in findings
                   if finding.joints and finding.effect not in left_out)
    return (*established, *_named_findings(check.named, method, left_out),
            *_findings_of_terms(check.terms, method, left_out))


def may_be_all(findings: Sequence[SignalFinding], problem: Problem) -> bool:
    """Whether what the check of the controller establishes may be all that is unknown.

    The counts of a coarse encoder are not, where the logs tell what they leave between them.
    """
    is_told = can_read_between_counts(problem)
    return any(one.effect != _COARSE or not is_told for one in findings)


def _findings_of_terms(terms: Sequence[Terms], method: VerdictMethod,
                       left_out: Collection[str]) -> Iterator[SignalFinding]:
    """Effects that are a term of the law, with the joints whose commands hold it."""
    for name in sorted({one.effect for one in terms if one.effect} - set(left_out)):
        same = [one for one in terms if one.effect == name]
        units = {p.name: p.unit for p in LIBRARY[name].parameters}
        yield SignalFinding(name, tuple(one.joint for one in same), method.certain, {
            key: entry(np.array([one.parameters[key] for one in same]), units[key])
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
        parameters[key] = entry(value, bound.unit, np.maximum(value - half, bound.lower),
                                 np.minimum(value + half, bound.upper))
    return SignalFinding(first, tuple(joint.joint for joint in joints), method.certain,
                         parameters, alike=tuple(name for name in names if name != first))


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
