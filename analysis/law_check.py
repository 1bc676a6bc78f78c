"""The command ``clie check``: the checks of a log, and its control law as a diagnosis sees it.

The law is replayed, corrected and, where it did not run, found by the code of the diagnosis, with
its thresholds.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence

from clie_blocks.analysis.records.check_report import Report, run_checks
from clie_blocks.analysis.records.checks import Finding
from clie_blocks.analysis.records.controller_section import PROGRAM
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import ClieError
from clie_blocks.output import run_main

OF_LAW = "law."  # begins the names of checks of the law
RESIDUAL = "law.residual"  # check of a law that is not what is stated, for want of a better name
ROBOT_IS_RIGHT = "A diagnosis goes on with the law that ran, so that no joint is blamed for it."


def main(argv: Sequence[str] | None = None) -> int:
    """Check logs; the worst exit code counts."""
    return run_checks(argv, with_replayed_law)


def with_replayed_law(reports: Sequence[Report], robot: Robot | None) -> list[Report]:
    """Reports of the logs of one robot, with the law that ran.

    Reports of a law that was understood, that no one states and the logs do not show, or that is
    a program which nobody allowed to run, stay as they are.
    """
    records = [report.record for report in reports]
    robot = robot or records[0].robot
    if robot is None or not _is_open(reports, robot):
        return list(reports)
    from clie_blocks.analysis.gap.controller.check import check_controller
    from clie_blocks.analysis.gap.problem.problem import Problem

    own = [record.replace(robot=robot) for record in records]
    try:
        check = check_controller(Problem.from_logs(robot, own, trust_logs=True))
    except ClieError:
        return list(reports)
    if not (check.laws or check.differences or check.unexplained) and (
            robot.controller.law == "unknown"):
        return list(reports)
    said = [(joint, sentence) for one in check.differences
            for joint, sentence in [_of_joint(one, robot)]]
    findings = [Finding("warning", "law.other", f"{sentence[0].upper()}{sentence[1:]}.",
                        "" if check.learned else ROBOT_IS_RIGHT, "", joint=joint)
                for joint, sentence in said]
    known = {robot.joints[one.joint] for one in check.laws}
    left = [robot.joints[k] for k in check.unexplained]
    law = ("found from the log" if check.learned else "understood" if check.as_stated else
           f"not reproduced on {', '.join(left)}" if left else
           "another law than stated, see law.other")
    return [_with_law(report, law, findings, known) for report in reports]


def _is_open(reports: Sequence[Report], robot: Robot) -> bool:
    """Whether the checks of single logs leave a question that a replay of the law answers."""
    law = robot.controller
    if any(report.facts is None for report in reports):
        return False
    if law.is_program:
        return law.law == PROGRAM and law.block is not None
    if law.is_block:
        return True
    logged = all(report.record.u is not None and report.record.qd is not None
                 for report in reports)
    return logged and (law.law == "unknown" or any(
        finding.check == RESIDUAL for report in reports for finding in report.findings))


def _of_joint(sentence: str, robot: Robot) -> tuple[str | None, str]:
    """Joint of which a sentence speaks, and what it says."""
    joint, _, rest = sentence.partition(": ")
    return (joint, rest) if joint in robot.joints else (None, sentence)


def _with_law(report: Report, law: str, findings: Sequence[Finding],
              known: Collection[str]) -> Report:
    """Report in which the law of some joints stands for what their log alone says of it."""
    from clie_blocks.analysis.records.checks.capability import Capability

    if report.facts is None:
        return report
    kept = [one for one in report.findings
            if not (one.joint in known and one.check.startswith(OF_LAW))]
    errors = any(one.severity == "error" for one in kept)
    capable = [Capability(one.subject, not law.startswith("not"), law)
               if one.subject.startswith("controller") else one for one in report.capabilities]
    return dataclasses.replace(
        report, findings=[*kept, *findings], capabilities=capable,
        exit_code=report.exit_code if errors else 0,
        facts=dataclasses.replace(report.facts, law=law))


if __name__ == "__main__":
    run_main(main)
