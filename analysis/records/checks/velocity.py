"""Checks of a logged velocity against the change of the position over the same time."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.measures import (
    centres,
    correlation_matrix,
    half_width,
    increments,
    integrals,
    lag,
    permutation,
    slope,
)
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot

DEGREE = 180 / np.pi


def check_velocity(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on scale, sign, order and delay of the logged velocity."""
    if record.dq is None:
        return []
    width = half_width(record)
    at = centres(record, width)
    if at.size < 10:
        return []
    moved, integral = increments(record.q, at, width), integrals(record, record.dq, at, width)
    order = permutation(correlation_matrix(integral, moved))
    if order is not None:
        pairs = ", ".join(f"dq of {record.joints[i]} belongs to {record.joints[j]}"
                          for i, j in enumerate(order) if i != j)
        return [Finding("error", "velocity.swapped", f"The velocities are in another order than "
                        f"the positions: {pairs}.", "Every joint would be given another's motion.",
                        f"Reorder them: permutation {[j + 1 for j in order]}.")]
    return [finding for k in range(record.n)
            for finding in _joint(record, robot, k, moved[:, k], integral[:, k], at, width)]


def _joint(record: Record, robot: Robot | None, k: int, moved: np.ndarray, integral: np.ndarray,
           at: np.ndarray, width: int) -> list[Finding]:
    scale, match = slope(moved, integral)
    name = record.joints[k]
    if not abs(match) > 0.7:
        return [] if np.ptp(moved) == 0 or not np.isfinite(match) else [Finding(
            "warning", "velocity.unlike", f"Its velocity does not follow its position "
            f"(correlation {match:.2f}).", "One of the two is not what its column says.",
            "The velocity is taken from the position; check the column.", joint=name)]
    if match < 0:
        return [Finding("error", "velocity.sign", "Its velocity has the sign opposite to the "
                        "change of its position.", "Damping would look like drive.",
                        "Invert it: sign = -1 for dq.", joint=name)]
    return _scale(record, robot, k, scale) or _delay(record, k, at, width)


def _scale(record: Record, robot: Robot | None, k: int, scale: float) -> list[Finding]:
    name, ratio = record.joints[k], _gear_ratio(robot, k)
    if ratio and ratio > 1.5 and (abs(scale / ratio - 1) < 0.1 or abs(scale * ratio - 1) < 0.1):
        one, other = ("motor", "joint") if scale > 1 else ("joint", "motor")
        return [Finding("error", "velocity.side", f"Its velocity is {scale:.4g} times the rate of "
                        f"its position, the gear ratio being {ratio:g}: dq is on the {one} side, "
                        f"q on the {other} side.", "Inertia and friction would be wrong by its "
                        "square.", "Divide by the gear ratio, or log both on one side.",
                        joint=name)]
    for factor, unit, rescale in ((DEGREE, "deg/s", ("dq", 1 / DEGREE)),
                                  (1 / DEGREE, "rad/s while q is in deg", ("q", 1 / DEGREE))):
        if abs(scale / factor - 1) < 0.1:
            return [Finding("warning", "units.velocity", f"Its velocity is {scale:.4g} times the "
                            f"rate of its position, as if dq were in {unit}.",
                            "Friction would be wrong by 57.3.", "State the unit in the header, as "
                            f"dq_{name}[deg/s], or in [units].",
                            joint=name, rescale=rescale)]
    if abs(scale - 1) > 0.05:
        return [Finding("warning", "velocity.scale", f"Its velocity is {scale:.4g} times the rate "
                        "of its position.", "Friction would be wrong by as much.",
                        "The velocity is taken from the position; check its unit.", joint=name)]
    return []


def _delay(record: Record, k: int, at: np.ndarray, width: int) -> list[Finding]:
    """Trailing of the logged velocity behind the position's own rate."""
    rate = np.gradient(record.q[:, k])
    trails = lag(record, np.cumsum(np.nan_to_num(rate)),
                 np.cumsum(np.nan_to_num(record.signal("dq")[:, k])),
                 at, width)
    if not abs(trails) > 1.0:
        return []
    return [Finding("warning", "velocity.late", f"Its velocity trails the position by "
                    f"{1e3 * trails * record.sample_time:.3g} ms ({trails:.1f} samples), as a "
                    "filtered one does.", "A lag in the velocity looks like inertia.",
                    "The velocity is taken from the position, but for a law that reads this one: "
                    "state velocity_filter = \"exact\", or let a law of your own read dq[k].",
                    joint=record.joints[k])]


def _gear_ratio(robot: Robot | None, k: int) -> float | None:
    ratio = robot.motor.gear_ratio if robot else None
    return None if ratio is None else float(ratio[k])
