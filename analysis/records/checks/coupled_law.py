"""Commands that follow the positions of other joints, too: those of motors that are coupled.

The law of a motor acts on the position of the motor, q_m = C^-1 q.  Where logs hold positions of
the joints and no coupling is stated, the command of a motor then follows several joints, each by
its entry of C^-1, and by the same gains and filter.
"""

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import Replay, velocity
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.uncertainty import least_squares

LEAST = 0.005  # turns of a motor per turn of another's joint, below which they are not coupled
DIGITS = 4  # of the entries of the matrix that is shown
WORST_CONDITION = 1e4  # of columns from which entries can be told


def check_coupled_law(record: Record, robot: Robot, result: Replay, unexplained: np.ndarray,
                      limit: np.ndarray) -> list[Finding]:
    """Finding on commands that the law explains with the positions of several joints.

    Parameters
    ----------
    record, robot, result
        Log, robot, and the replay of the stated law.
    unexplained : ndarray of bool, shape (n,)
        Joints whose commands the law does not explain.
    limit : ndarray, shape (n,)
        RMS that rounding explains [unit of u].

    """
    seen = np.eye(record.n)
    for k in np.flatnonzero(unexplained):
        row = _shares(record, robot, result, int(k), float(limit[k]))
        if row is None:
            return []
        seen[k] = row
    if np.linalg.cond(seen) > WORST_CONDITION:
        return []
    stated = np.eye(record.n) if robot.motor.coupling is None else robot.motor.coupling
    shares = ", ".join(f"{seen[k, j]:.4g} times that of {record.joints[j]} at {record.joints[k]}"
                       for k, j in zip(*np.nonzero(seen - np.eye(record.n))))
    return [Finding(
        "error", "law.coupled", "The commands follow the position of another joint, too, by the "
        f"stated law: {shares}. So motors turn several joints.",
        "Torques of such a motor act on each of them, and look like faults of drives.",
        f"State motor_coupling = {_listed(stated @ np.linalg.inv(seen))} in [motor].",
        joint=record.joints[int(np.flatnonzero(unexplained)[0])])]


def _shares(record: Record, robot: Robot, result: Replay, k: int, limit: float,
            ) -> np.ndarray | None:
    """By how much the command of a motor follows each joint; None where that is not why."""
    others = [j for j in range(record.n) if j != k]
    if not others:
        return None
    error = record.signal("qd") - record.q
    rate = velocity(record, robot.controller, result.variant)
    columns = (result.law.kp[k] * error - result.law.kd[k] * rate)[:, others]
    used = result.used & np.isfinite(columns).all(axis=1)
    matrix, target = columns[used], result.residual[used, k]
    size = np.linalg.norm(matrix, axis=0)
    if not size.all() or np.linalg.cond(matrix / size) > WORST_CONDITION:
        return None
    share = least_squares(matrix, target).value
    share = np.where(np.abs(share) < LEAST, 0.0, share)
    left = np.sqrt(np.mean((target - matrix @ share) ** 2))
    if not share.any() or left > limit * np.sqrt(1.0 + share @ share):
        return None
    row = np.eye(record.n)[k]
    row[others] = share
    return row


def _listed(matrix: np.ndarray) -> str:
    rows = (", ".join(f"{round(entry, DIGITS) + 0.0:g}" for entry in row) for row in matrix)
    return f"[{', '.join(f'[{row}]' for row in rows)}]"
