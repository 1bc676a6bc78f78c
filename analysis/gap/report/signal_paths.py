"""Findings on the command path: delayed set-points of servos, delayed and weak drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.wording import Units, effect_title, number, with_prefix
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding
from clie_blocks.analysis.report.document import Section, Table

OF_SET_POINTS = (
    "The command of these servos is not logged, so the path from set-point to motion is fitted as "
    "a whole to the first log and validated on the others. A delay and dry friction hide each "
    "other: without friction in the model the delay cannot be identified, and without the delay "
    "friction takes its part. The dead time is what the log shows directly: from the last sample "
    "under an old set-point to the first one beyond 5 % of a step, with lag, friction and the "
    "sampling included. The models of the motion hold each position error for one sample, which "
    "acts like the delay; a simulator whose servo holds nothing needs the delay itself.")
OF_TORQUES = (
    "The measured torque is compared with the commanded one, without a model of the robot. The "
    "motion is not used, and the models of the motion do not contain this cause.")
ERROR_WITH = {"lag": "with a lag alone", "setpoint_delay": "and a set-point delay",
              "coulomb": "and dry friction", "both": "and both"}


def signal_paths_section(result: Result, units: Units) -> Section | None:
    """Causes on the command path; None where there are none."""
    if not result.findings:
        return None
    joints = result.problem.joints
    rows = tuple(row for finding in result.findings for row in _parameters(finding, joints))
    tables = [Table(("cause", "joint", "value", "95 % interval", "unit"), rows)]
    with_errors = [finding for finding in result.findings if finding.left]
    tables += [_errors(finding, joints, units) for finding in with_errors]
    of_torques = any(finding.effect in ("actuator_lag", "torque_gain_error")
                     for finding in result.findings)
    text = ((OF_SET_POINTS,) if with_errors else ()) + ((OF_TORQUES,) if of_torques else ())
    return Section("On the command path", text, tables=tuple(tables))


def _parameters(finding: SignalFinding, joints: Sequence[str]) -> Iterator[tuple[str, ...]]:
    for name, entry in finding.parameters.items():
        low, high = entry["interval"] or np.full((2, len(finding.joints)), np.nan)
        for i, k in enumerate(finding.joints):
            yield (f"{effect_title(finding.effect)}: {effect_title(name)}", joints[k],
                   number(entry["value"][i], 4),
                   f"{number(low[i])} .. {number(high[i])}" if np.isfinite(low[i]) else "-",
                   entry["unit"])


def _errors(finding: SignalFinding, joints: Sequence[str], units: Units) -> Table:
    return Table(("joint", *ERROR_WITH.values()), tuple(
        (joints[k], *(with_prefix(finding.left[path][i], units["q"]) for path in ERROR_WITH))
        for i, k in enumerate(finding.joints)),
        "RMS prediction error on logs that were not fitted, by model of the servo.")
