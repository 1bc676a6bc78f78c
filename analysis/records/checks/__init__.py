"""Checks of a log: each a function from record and robot to the faults that it finds."""

from collections.abc import Sequence

from clie_blocks.analysis.records.checks.clock import check_clock, even_clock, without_copies
from clie_blocks.analysis.records.checks.command import check_saturation, check_torque
from clie_blocks.analysis.records.checks.completeness import check_alive, check_missing
from clie_blocks.analysis.records.checks.excitation import check_excitation
from clie_blocks.analysis.records.checks.finding import SEVERITIES, Finding, fix_units
from clie_blocks.analysis.records.checks.law import check_law
from clie_blocks.analysis.records.checks.link_model import check_link_model
from clie_blocks.analysis.records.checks.reach import check_reach
from clie_blocks.analysis.records.checks.reference import check_reference
from clie_blocks.analysis.records.checks.scale import check_scale
from clie_blocks.analysis.records.checks.stability import check_gains
from clie_blocks.analysis.records.checks.velocity import check_velocity
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot, as_checks_see
from clie_blocks.analysis.records.table import drop_pages

__all__ = ["CHECKS", "FATAL", "Finding", "check_record", "fix_units"]

CHECKS = (check_alive, check_reference, check_velocity, check_law,
          check_gains, check_saturation, check_torque, check_link_model, check_reach,
          check_excitation)
FATAL = ("clock.stopped", "clock.backward", "clock.unit", "missing.run", "signal.absurd")


def check_record(record: Record, robot: Robot | None = None, others: Sequence[Record] = (),
                 ) -> list[Finding]:
    """Run every check on a record.

    Parameters
    ----------
    record : Record
        The log.
    robot : Robot, optional
        What is known of the robot; by default the record's own.
    others : sequence of Record
        Further logs of the same robot.

    Returns
    -------
    list of Finding
        Errors first, then warnings, then repairs.

    """
    robot = as_checks_see(robot or record.robot)
    findings = [*check_clock(record, robot), *check_missing(record, robot)]
    if not any(finding.check in FATAL for finding in findings):
        steady = even_clock(without_copies(record), robot)
        for check in CHECKS:
            drop_pages(steady.q)  # of a long log; what a check reads comes back
            findings += check(steady, robot)
        findings += check_scale(steady, robot, others)
    return sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))
