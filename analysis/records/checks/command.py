"""Checks of command and torque: limits, flat tops, sign, and what the torque sensor says."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import MOST_RANGES, Finding, ranges
from clie_blocks.analysis.records.checks.measures import (
    centres,
    half_width,
    lag,
    moves,
    slope,
    smooth_motion,
    triangular_mean,
)
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot

TOO_MUCH = 0.30
WORTH_SAYING = 0.002
FLAT = 3  # equal samples at the largest value that make a flat top


def check_saturation(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on commands that never change or are at their limit, stated or a flat top."""
    if record.u is None:
        return []
    u = record.u
    findings = [Finding("warning", "command.dead", "Its command never changes.",
                        "What moves the joint is then not in the log.",
                        "Name the right column: --map u=COLUMN.", joint=record.joints[k])
                for k in range(record.n) if not moves(u[record.valid, k])]
    for k in range(record.n):
        at_limit, limit = samples_at_limit(record, robot, k)
        share = at_limit[record.valid].mean() if record.valid.any() else 0.0
        if share < WORTH_SAYING:
            continue
        severity = "error" if share > TOO_MUCH else "repair"
        fix = ("Repeat it with a smaller motion or lower gains." if severity == "error" else
               "Those samples get no weight where the command is taken as the torque.")
        findings.append(Finding(severity, "command.saturated", f"Its command is at its limit of "
                                f"{limit:.4g} for {share:.1%} of the samples.",
                                "At the limit the law's command does not reach the robot.", fix,
                                joint=record.joints[k], samples=ranges(at_limit)[:MOST_RANGES]))
    return findings + _above_peak(record, robot)


def samples_at_limit(record: Record, robot: Robot | None, k: int) -> tuple[np.ndarray, float]:
    """Mask of the samples at which the command of joint k is at its limit, and the limit."""
    u = np.abs(record.signal("u")[:, k])
    stated = robot.controller.saturation if robot else None
    limit = float(np.nanmax(u, initial=0.0) if stated is None else stated[k])
    top = u >= limit * (1 - 1e-6) if limit > 0 else np.zeros(u.size, bool)
    if stated is not None:
        return top, limit
    if not moves(u[np.isfinite(u)]):
        return np.zeros(u.size, bool), limit
    flat = np.zeros(u.size, bool)
    for start, stop in ranges(top):
        flat[start:stop] = stop - start >= FLAT
    return flat, limit


def check_torque(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on a logged torque: unsigned, inverted, delayed, a copy of the command."""
    if record.tau is None:
        return []
    width = half_width(record)
    at = centres(record, width)
    if at.size < 10:
        return []
    return [finding for k in range(record.n) for finding in _torque(record, robot, k, at, width)]


def _above_peak(record: Record, robot: Robot | None) -> list[Finding]:
    peak = robot.motor.peak_torque if robot else None
    if peak is None or record.units["u"][0] != "N m":
        return []
    share = np.mean(np.abs(record.signal("u")[record.valid]) > peak, axis=0)
    return [Finding("warning", "command.above_peak", f"Its command exceeds the motor's peak torque"
                    f" of {peak[k]:g} N m for {share[k]:.1%} of the samples.",
                    "There the motor gives less than the command.",
                    "Use a smaller motion, or state the limit as saturation_nm.",
                    joint=record.joints[k]) for k in np.flatnonzero(share > WORTH_SAYING)]


def _torque(record: Record, robot: Robot | None, k: int, at: np.ndarray,
            width: int) -> list[Finding]:
    tau, name = record.signal("tau")[:, k], record.joints[k]
    used = tau[np.isfinite(tau)]
    if used.size == 0 or np.ptp(used) == 0:
        return []
    dq = smooth_motion(record, at, width)[1][:, k]
    both_ways = min(np.mean(dq > 0.1 * dq.std()), np.mean(dq < -0.1 * dq.std())) > 0.05
    if used.min() >= 0 and both_ways:
        return [Finding("warning", "torque.unsigned", "Its torque is never negative although it "
                        "moves in both directions.", "It is a magnitude, as of a current "
                        "register; its sign would be a guess.",
                        "It is not used as a torque; log the signed "
                        "current.", joint=name)]
    if record.u is None:
        return []
    if np.array_equal(tau, record.u[:, k]):
        return [Finding("warning", "torque.copied", "Its torque equals its command at every "
                        "sample.", "It shows nothing of the drive.",
                        "Log both: what was commanded, and what was measured.", joint=name)]
    return _against_command(record, robot, k, at, width)


def _against_command(record: Record, robot: Robot | None, k: int, at: np.ndarray,
                     width: int) -> list[Finding]:
    command, torque = (triangular_mean(record.signal(signal)[:, k:k + 1], at, width)[:, 0]
                       for signal in ("u", "tau"))
    name = record.joints[k]
    scale, match = slope(command - command.mean(), torque - torque.mean())
    if not abs(match) > 0.7:
        return []
    if match < 0:
        return [Finding("error", "torque.sign", "Its torque has the sign opposite to its command.",
                        "The drive would take energy out.", "Invert one: sign = -1.", joint=name)]
    ratio = robot.motor.gear_ratio if robot else None
    if ratio is not None and ratio[k] > 1.5 and abs(scale / ratio[k] - 1) < 0.15:
        return [Finding("error", "torque.side", f"Its torque is {scale:.4g} times its command, "
                        f"the gear ratio being {ratio[k]:g}: tau is on the joint side, u on the "
                        "motor side.", "Parameters would be wrong by the ratio.",
                        "Divide tau by the gear ratio.", joint=name)]
    return _late(record, k, at)


def _late(record: Record, k: int, at: np.ndarray) -> list[Finding]:
    u, tau = record.signal("u")[:, k], record.signal("tau")[:, k]
    trails = lag(record, u, tau, at, half_width(record, 0.01))
    if not trails > 1.0:
        return []
    return [Finding("warning", "torque.late", f"Its torque trails its command by "
                    f"{1e3 * trails * record.sample_time:.3g} ms ({trails:.1f} samples).",
                    "Either the drive or the filter of the torque is slow; the log alone does not "
                    "decide which.", "The delay is kept; the diagnosis considers it as a cause.",
                    joint=record.joints[k])]
