"""Checks of length and rate: what a log is too short or too coarse in time to show."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.stability import nominal_joints
from clie_blocks.analysis.records.control_law import gains
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot

SHORT = 5.0  # s
SLOW = 100.0  # Hz
PER_PERIOD = 20  # samples per period of the loop, to simulate its controller from the log


def check_reach(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on logs that are short, or slow against the loop."""
    return [*_short(record), *_slow(record, robot)]


def _short(record: Record) -> list[Finding]:
    if record.duration >= SHORT:
        return []
    return [Finding("warning", "reach.short", f"The log is {record.duration:.3g} s long.",
                    "Drift, slow disturbances and faults are out of reach, and intervals rest on "
                    "few independent samples.", "Take 20 s or more, or several logs.")]


def _slow(record: Record, robot: Robot | None) -> list[Finding]:
    rate = 1 / record.sample_time
    needed = PER_PERIOD * _loop_frequency(robot)
    if rate >= max(SLOW, needed):
        return []
    loop = f"; the loop itself needs {needed:.3g} Hz" if rate < needed else ""
    return [Finding("warning", "reach.slow", f"The log has {rate:.4g} Hz{loop}.",
                    f"Effects faster than {rate / 2:.3g} Hz are out of reach: delays below "
                    f"{1e3 / rate:.3g} ms, lags, elasticity, ripple at speed.",
                    "Log every cycle of the controller.")]


def _loop_frequency(robot: Robot | None) -> float:
    """Natural frequency of the fastest nominal loop [Hz]; zero where it is not known."""
    nominal = nominal_joints(robot)
    if robot is None or nominal is None or robot.controller.law not in ("pd", "cascade"):
        return 0.0
    return float(np.sqrt(np.max(nominal[1] * np.abs(gains(robot.controller)[0])))
                 / (2 * np.pi))
