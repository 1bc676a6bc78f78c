"""Checks of the logged reference against the position: identity, order, unit, side."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.law import (
    can_replay,
    explained_rms,
    replay_unsaturated,
)
from clie_blocks.analysis.records.checks.measures import (
    centres,
    correlation_matrix,
    half_width,
    increments,
    permutation,
    slope,
)
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot

DEGREE = 180 / np.pi
ALIKE = 0.6  # correlation of a position with its reference; a soft loop follows late
FACTOR = 1.35  # within which a soft loop's motion over its reference still shows a unit
GEARED = 3.0  # gear ratio from which it shows a side: soft loops alone move half their reference
TURNS = 3  # a joint that sweeps more than this many turns in radians is probably in degrees


def check_reference(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on the reference: logged twice, in another order, unit, or side of the gear."""
    if record.qd is None:
        return _range(record)
    copied = [k for k in range(record.n) if _identical(record.q[:, k], record.qd[:, k])]
    if copied:
        return [Finding("error", "reference.copied", "Its reference equals its position at every "
                        "sample: one was logged as the other.", "The loop seems to have no error, "
                        "so it shows nothing of controller or robot.",
                        "Log the measurement, or name its column: --map q=COLUMN.",
                        joint=record.joints[k]) for k in copied]
    width = half_width(record, 0.5)
    at = centres(record, width)
    if at.size < 10:
        return _range(record)
    wanted, moved = increments(record.qd, at, width), increments(record.q, at, width)
    order = _order(wanted, moved)
    if order is not None:
        pairs = ", ".join(f"qd of {record.joints[i]} is followed by {record.joints[j]}"
                          for i, j in enumerate(order) if i != j)
        return [Finding("error", "reference.swapped", f"Joints are swapped: {pairs}.",
                        "Every joint would be given another's model.",
                        f"Reorder the columns: permutation {[j + 1 for j in order]}.")]
    scaled = [finding for k in range(record.n)
              for finding in _scale(record, robot, k, wanted[:, k], moved[:, k])]
    proven = _follow_the_law(record, robot) if scaled else []
    return [*_range(record), *(finding for finding in scaled if finding.joint not in proven)]


def _follow_the_law(record: Record, robot: Robot | None) -> list[str]:
    """Joints whose command follows from position and reference: both have one unit and side."""
    if robot is None or not can_replay(record, robot):
        return []
    best = replay_unsaturated(record, robot)
    return [record.joints[k]
            for k in np.flatnonzero(best.rms <= explained_rms(record, robot, best))]


def _identical(q: np.ndarray, qd: np.ndarray) -> bool:
    both = np.isfinite(q) & np.isfinite(qd)
    return both.any() and np.ptp(q[both]) > 0 and bool(np.all(q[both] == qd[both]))


def _order(wanted: np.ndarray, moved: np.ndarray) -> list[int] | None:
    """Permutation of the joints whose reference moves; the others stay where they are."""
    size = np.sqrt(np.mean(wanted**2, axis=0))
    live = np.flatnonzero(size > 0.02 * size.max(initial=0))
    of_live = None if live.size < 2 else permutation(
        correlation_matrix(wanted[:, live], moved[:, live]), ALIKE)
    if of_live is None:
        return None
    order = list(range(wanted.shape[1]))
    for i, j in zip(live, of_live, strict=True):
        order[i] = int(live[j])
    return order


def _scale(record: Record, robot: Robot | None, k: int, wanted: np.ndarray,
           moved: np.ndarray) -> list[Finding]:
    scale, match = slope(wanted, moved)
    name = record.joints[k]
    if not abs(match) > ALIKE:
        return []
    if scale < 0:
        return [Finding("error", "reference.sign", "It moves opposite to its reference.",
                        "Such a loop could not be stable, so a sign in the log is wrong.",
                        "Invert the position or the reference: sign = -1.", joint=name)]
    causes = _causes(robot, k, scale)
    if not causes:
        return []
    what = f"It moves {scale:.4g} times its reference, as if {' or '.join(causes.values())}."
    if causes.keys() & {"q", "qd"}:
        signal = "q" if "q" in causes else "qd"
        return [Finding("warning", "units.reference", what,
                        "The gains would be wrong by as much.",
                        f"State the unit in the header, as {signal}_{name}[deg], or in "
                        "[units].", joint=name,
                        rescale=(signal, 1 / DEGREE) if len(causes) == 1 else None)]
    return [Finding("error", "reference.side", what, "The control error would be meaningless.",
                    "Divide the motor side by the gear ratio.", joint=name)]


def _causes(robot: Robot | None, k: int, scale: float) -> dict[str, str]:
    """What a motion of `scale` times its reference may come from, by signal or side."""
    known = {"q": (DEGREE, "the position were in deg and the reference in rad"),
             "qd": (1 / DEGREE, "the reference were in deg and the position in rad")}
    ratio = robot.motor.gear_ratio if robot else None
    if ratio is not None and ratio[k] >= GEARED:
        side = f"were on the motor side of a gear of {ratio[k]:g}, the other on the joint side"
        known["motor q"] = ratio[k], f"the position {side}"
        known["motor qd"] = 1 / ratio[k], f"the reference {side}"
    return {key: text for key, (factor, text) in known.items()
            if 1 / FACTOR < scale / factor < FACTOR}


def _range(record: Record) -> list[Finding]:
    sweep = np.nanmax(record.q, axis=0) - np.nanmin(record.q, axis=0)
    return [Finding("warning", "units.range", f"It sweeps {sweep[k]:.4g} rad, "
                    f"{sweep[k] / 2 / np.pi:.1f} turns: is it in degrees?",
                    "In degrees every gain and inertia would be wrong by 57.3.",
                    f"If so, write q_{record.joints[k]}[deg] in the header or give --map with the "
                    "unit; a joint that turns freely is fine.", joint=record.joints[k])
            for k in range(record.n)
            if record.units["q"][k] == "rad" and sweep[k] > TURNS * 2 * np.pi]
