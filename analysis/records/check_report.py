"""The command ``clie check`` reports whether a log is sound and what it can show."""

import argparse
import dataclasses
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.records.checks import (
    FATAL,
    SEVERITIES,
    Finding,
    check_record,
    fix_units,
)
from clie_blocks.analysis.records.checks.capability import (
    Capability,
    Facts,
    best_experiment,
    capabilities,
    facts,
)
from clie_blocks.analysis.records.checks.clock import even_clock, without_copies
from clie_blocks.analysis.records.corrections import Correction, Examination, correct
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.read import read_logs
from clie_blocks.analysis.records.reading import add_reading_options, reading
from clie_blocks.analysis.records.robot import Robot, as_checks_see
from clie_blocks.analysis.records.robot_file import read_robot
from clie_blocks.output import command_parser, counted, progress, run_main, to_json, wrapped

SCHEMA_VERSION = 1
NOT_IDENTIFIABLE = ("excitation.weak", "excitation.none")


@dataclasses.dataclass(frozen=True, eq=False)
class Report:
    """What `check_log` found: findings, capabilities, the advised experiment, the exit code."""

    record: Record
    findings: list[Finding]
    facts: Facts | None
    capabilities: list[Capability]
    experiment: str
    exit_code: int
    corrections: tuple[Correction, ...] = ()

    @property
    def verdict(self) -> str:
        """One sentence."""
        if self.exit_code == 4:
            return "sound, but the motion does not show the parameters"
        if self.exit_code:
            return f"not usable as it is: {self._count('error')}"
        warned, count = self._count("warning"), len(self.corrections)
        corrected = f" after {count} correction{'s' if count > 1 else ''}" if count else ""
        return f"usable{corrected}, with {warned}" if warned else f"sound{corrected}"

    def _count(self, severity: str) -> str:
        found = sum(finding.severity == severity for finding in self.findings)
        return f"{found} {severity}{'s' if found > 1 else ''}" if found else ""


OfRobot = Callable[[Sequence[Report], Robot | None], Sequence[Report]]


def check_log(record: Record, robot: Robot | None = None, others: Sequence[Record] = ()) -> Report:
    """Check one record and assess what can be learned from it.

    Parameters
    ----------
    record : Record
        The log.
    robot : Robot, optional
        What is known of the robot; by default the record's own.
    others : sequence of Record
        Further runs of the same robot; repeats among them measure the noise.

    Returns
    -------
    Report
        Findings in order of weight, capabilities, experiment and exit code.

    """
    robot = as_checks_see(robot or record.robot)
    findings = check_record(record, robot, others)
    errors = [finding.check for finding in findings if finding.severity == "error"]
    if any(check in FATAL for check in errors):
        return Report(record, findings, None, [], findings[0].fix, 1)
    steady = even_clock(without_copies(record), robot)
    known = facts(steady, robot, others)
    code = 0 if not errors else 4 if set(errors) <= set(NOT_IDENTIFIABLE) else 1
    return Report(steady, findings, known, capabilities(steady, robot, known),
                  best_experiment(steady, known), code)


def check_logs(records: Sequence[Record], robot: Robot | None = None) -> list[Report]:
    """Check logs, those of one robot together, after the corrections that a diagnosis makes.

    Parameters
    ----------
    records : sequence of Record
        The logs.
    robot : Robot, optional
        What is known of the robot; by default each record's own.

    Returns
    -------
    list of Report
        In the order of the logs.

    """
    groups: dict[object, list[Record]] = {}
    for record in records:
        own = robot or record.robot
        groups.setdefault(own and (own.source or id(own)), []).append(record)
    reports = {}
    for group in groups.values():
        own = as_checks_see(robot or group[0].robot)
        seen = None if own is None else correct(group, own)
        logs = group if seen is None else seen.records
        for record, corrected in zip(group, logs, strict=True):
            report = check_log(corrected, own, [log for log in logs if log is not corrected])
            reports[id(record)] = report if seen is None else _with_corrections(report, seen)
    return [reports[id(record)] for record in records]


def _by_robot(reports: Sequence[Report], records: Sequence[Record], robot: Robot | None,
              change: OfRobot) -> list[Report]:
    """Reports as a function returns those of the logs of one robot."""
    groups: dict[object, list[int]] = {}
    for k, record in enumerate(records):
        own = robot or record.robot
        groups.setdefault(own and (own.source or id(own)), []).append(k)
    changed = list(reports)
    for group in groups.values():
        own = robot or records[group[0]].robot
        for k, report in zip(group, change([reports[k] for k in group], own), strict=True):
            changed[k] = report
    return changed


def _with_corrections(report: Report, seen: Examination) -> Report:
    """Report of a log with what all logs of its robot show together."""
    named = {finding.check for finding in seen.obstacles}
    findings = [*seen.obstacles, *(one for one in report.findings if one.check not in named)]
    return dataclasses.replace(
        report, findings=findings, corrections=seen.corrections,
        exit_code=1 if seen.obstacles and report.exit_code != 4 else report.exit_code)


def main(argv: Sequence[str] | None = None) -> int:
    """Check logs, each by itself; the worst exit code counts."""
    return run_checks(argv)


def run_checks(argv: Sequence[str] | None = None, of_robot: OfRobot | None = None) -> int:
    """Check logs, with what `of_robot` makes of the reports of the logs of one robot."""
    options = _parser().parse_args(argv)
    robot = read_robot(options.robot) if options.robot else None
    with progress("reading"):
        records = read_logs(options.logs, robot, **reading(options).keywords())
    if options.fix_units:
        records = [fix_units(record, check_record(record, robot)) for record in records]
    with progress("checking"):
        reports = check_logs(records, robot)
        if of_robot is not None:
            reports = _by_robot(reports, records, robot, of_robot)
    if options.json:
        print(to_json({"schema_version": SCHEMA_VERSION, "logs": [as_dict(r) for r in reports]}))
    else:
        print("\n\n".join(as_text(report) for report in reports))
    if options.output:
        from clie_blocks.analysis.records.check_page import save_page

        for number, report in enumerate(reports, 1):
            for path in save_page(report.record, report.findings, report.verdict, options.output,
                                  f"check-{number}"):
                print(f"wrote {path}", file=sys.stderr)
    if not options.json and (step := _next(options, reports)):
        print(f"\nNext: {step}", file=sys.stderr)
    return _exit_code(reports)


def _next(options: argparse.Namespace, reports: Sequence[Report]) -> str:
    """Command that goes on with the logs, with what was stated to read them; empty if none."""
    if any(report.exit_code for report in reports):
        return ""
    stated = [] if options.robot is None else ["--robot", options.robot]
    read = [*stated, *reading(options).arguments()]
    records = [report.record for report in reports]
    if any(record.robot is None for record in records):
        return shlex.join(["clie", "robot", options.logs[0], "-o", "begun"])
    if all(record.u is not None for record in records):
        return shlex.join(["clie", "identify", *options.logs, *read])
    return shlex.join(["clie", "diagnose", *options.logs, *read, "-o", "out"])


def as_text(report: Report) -> str:
    """Report as lines: verdict, joints, findings, what can be diagnosed, experiment."""
    record = report.record
    lines = [f"CORRECTED [{one.check}] {one}" for one in report.corrections]
    lines += [_outline(record), ""]
    lines += [_joint_line(report, report.facts, k)
              for k in range(record.n)] if report.facts else []
    for severity in SEVERITIES:
        lines += [f"{severity.upper()} {text}" for text in _grouped(report.findings, severity)]
    lines += [f"READ {sentence}" for sentence in record.decisions]
    parts = [wrapped(f"{record.source}: {report.verdict}"), *_indented(lines)]
    for title, wanted in (("Can be diagnosed:", True), ("Cannot:", False)):
        found = [f"{c.subject}: {c.reason}" for c in report.capabilities if c.possible == wanted]
        parts += ["", title, *_indented(found)] if found else []
    return "\n".join([*parts, "", wrapped(f"Most helpful next: {report.experiment}")])


def _indented(lines: Iterable[str]) -> Iterator[str]:
    return (wrapped(line, "  ") for line in lines)


def _outline(record: Record) -> str:
    rate = f" at {1 / record.sample_time:.5g} Hz" if record.sample_time > 0 else ""
    return (f"{len(record)} samples, {record.duration:.4g} s{rate}, "
            f"{counted(record.n, 'joint')}, signals {' '.join(record.signals)}")


def as_dict(report: Report) -> dict[str, Any]:
    """Report as plain values for JSON."""
    record, known = report.record, report.facts
    return {
        "source": record.source, "verdict": report.verdict, "exit_code": report.exit_code,
        "samples": len(record), "duration_s": record.duration,
        "sample_time_s": record.sample_time, "signals": record.signals,
        "joints": [{"name": name, **(_joint_values(report, known, k) if known else {})}
                   for k, name in enumerate(record.joints)],
        "corrections": [dataclasses.asdict(one) for one in report.corrections],
        "findings": [dataclasses.asdict(finding) for finding in report.findings],
        "decisions": record.decisions,
        "capabilities": [dataclasses.asdict(c) for c in report.capabilities],
        "experiment": report.experiment}


def _joint_values(report: Report, known: Facts, k: int) -> dict[str, Any]:
    motion = known.motions[k]
    return {"findings": _worst(report, k), "sweep": motion.sweep, "top_speed": motion.top_speed,
            "frequency_hz": motion.frequency, "reversals": motion.reversals,
            "noise": known.floor.std[k], "hidden": motion.hidden}


def _joint_line(report: Report, known: Facts, k: int) -> str:
    record, values = report.record, _joint_values(report, known, k)
    unit = record.units["q"][k]
    u = "" if record.u is None else (f", command {np.sqrt(np.nanmean(record.u[:, k] ** 2)):.3g} "
                                     f"{record.units['u'][k]} rms")
    return (f"{record.joints[k]}: {values['findings']}; sweeps {values['sweep']:.3g} {unit}, "
            f"up to {values['top_speed']:.3g} {unit}/s near {values['frequency_hz']:.2g} Hz, "
            f"{values['reversals']} reversals, noise {values['noise']:.2g} {unit}{u}")


def _worst(report: Report, k: int) -> str:
    """Gravest severity of the findings on a joint, or ``ok``."""
    own = {f.severity for f in report.findings if f.joint == report.record.joints[k]}
    return next((severity for severity in SEVERITIES if severity in own), "ok")


def _grouped(findings: Sequence[Finding], severity: str) -> Iterator[str]:
    """Texts of one severity; a fault that many joints share stands once, with their names."""
    groups: dict[str, list[Finding]] = {}
    for finding in findings:
        if finding.severity == severity:
            groups.setdefault(finding.check, []).append(finding)
    for check, group in groups.items():
        joints = ", ".join(finding.joint for finding in group if finding.joint)
        shared = dataclasses.replace(group[0], joint=joints or None)
        yield f"[{check}] {shared}" + (" (figures of the first)" if len(group) > 1 else "")


def _exit_code(reports: Sequence[Report]) -> int:
    codes = {report.exit_code for report in reports}
    if codes == {4} or 1 not in codes:
        return 4 if codes == {4} else 0
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = command_parser(
        "clie check", "Report whether a log is sound, and what it can show.",
        output_help="folder for a page with the signals",
        epilog="Exit codes: 0 usable, 1 errors found, 2 usage, 3 cannot be read, "
               "4 not identifiable.")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="file or folder")
    parser.add_argument("--robot", metavar="FILE", help="robot.toml; else the one next to the log")
    add_reading_options(parser)
    parser.add_argument("--fix-units", action="store_true",
                        help="apply the unit factors that the checks propose, and report them")
    return parser


if __name__ == "__main__":
    run_main(main)
