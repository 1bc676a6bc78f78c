"""Motion and torque of one side of a comparison, filtered alike."""

from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.linear_filters import low_pass

CORNER = 8.0  # Hz, of the zero-phase low-pass of motion and torque
CORNER_SHARE = 0.15  # of the rate of a log: its largest corner
EDGE = 0.3  # s at the ends of a log that belong to the filter
SLOW = 0.02  # of the top speed of a joint, below which dry friction may hold it at any level
LEAST_ROWS = 50  # of one log


class Motion(NamedTuple):
    """Filtered motion and joint torque of one log, with the rows that count."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray
    counted: np.ndarray
    step: float


def motions(problem: Problem) -> list[Motion]:
    """Motion and joint torque of every log of a problem."""
    return [_motion(log, problem) for log in problem.law_logs
            if log.sample_count() > LEAST_ROWS]


def filtered(x: np.ndarray, step: float) -> np.ndarray:
    """Signals below the corner, without a shift in time, along the first axis."""
    return low_pass(x, 4, min(CORNER, CORNER_SHARE / step), 1.0 / step)


def _motion(log: Log, problem: Problem) -> Motion:
    step = problem.period * log.stride
    q = filtered(log.q[::log.stride], step)
    dq = np.gradient(q, step, axis=0)
    counted = np.ones(len(q), bool) if log.counted is None else log.counted.copy()
    edge = max(1, round(EDGE / step))
    counted[:edge] = counted[-edge:] = False
    torque = filtered(log.u[::log.stride] * problem.gear_ratio, step)
    return Motion(q, dq, np.gradient(dq, step, axis=0), torque, counted, step)


def top_speed(sides: list[list[Motion]]) -> np.ndarray:
    """Largest speed of each joint over all logs, shape (n,)."""
    return np.max([np.abs(motion.dq[motion.counted]).max(axis=0)
                   for side in sides for motion in side], axis=0)
