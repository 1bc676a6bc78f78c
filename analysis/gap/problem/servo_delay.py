"""Whether a servo's set-points are delayed, where its weight hides what a delay explains.

Besides a delay, only a course of its own on which the servo goes to a set-point lets it answer
late at first.  Where such a course explains the motion far better, there is no delay; where both
explain it alike, the log does not tell them apart.
"""

from __future__ import annotations

import numpy as np

from clie_blocks.analysis.gap.problem.position_path import (
    UNSETTLED_SAMPLES,
    PositionPath,
    fit_position_path,
    prediction_error,
)
from clie_blocks.analysis.records import Record

MOVE_TIME = 0.5  # s, of a log, in which a servo has answered: errors beyond it count as others
LEAST_MOVES = 10  # of each half of a log: with fewer, none is told from an accident
LEAST_DELAY = 0.5  # samples, of a delay that is told from the hold of a reading
ACCIDENT = 1e-3  # probability that errors without a delay are as much larger by chance
FAR_BETTER = 0.5  # of the square error that a delay leaves, which another explanation leaves
COURSES = (*({"ramp": ramp} for ramp in (5e-4, 1e-3, 2e-3, 4e-3, 1e-2, 2.5e-2)),
           *({"rate": rate} for rate in (2.0, 4.0, 8.0, 16.0)))  # s^2/rad, rad/s
_OF_ROBOT = ("level", "sag")


def shows_delay(record: Record, k: int) -> bool:
    """Whether a delay explains how one joint follows its set-points, with friction and weight.

    Each half of the log is explained with the delay that the other half has, and without one; lag,
    friction and sag are fitted to it both times.  The delay must win in both halves, by errors
    over moves that a rank test calls no accident, be longer than half a sample, and leave no more
    than twice the square error of a servo that goes to its set-points on a course of its own.
    """
    half = len(record) // 2
    parts = record.part(0, half), record.part(half, len(record))
    if half - UNSETTLED_SAMPLES < LEAST_MOVES * _samples_of_move(record) or any(
            np.ptp(part.signal("qd")[:, k]) == 0.0 for part in parts):
        return False
    return all(_wins(part, other, k) for part, other in (parts, parts[::-1]))


def _wins(part: Record, other: Record, k: int) -> bool:
    """Whether the delay of one part of a log explains the other part."""
    from scipy.stats import wilcoxon

    delay = fit_position_path(other, k, ("delay", *_OF_ROBOT)).delay
    if delay < LEAST_DELAY * part.sample_time:
        return False
    late, prompt = (fit_position_path(part, k, _OF_ROBOT, {"delay": one}) for one in (delay, 0.0))
    late_errors, prompt_errors = (_error_by_move(path, part, k) for path in (late, prompt))
    if not wilcoxon(late_errors, prompt_errors, alternative="less").pvalue <= ACCIDENT:
        return False
    start = {name: getattr(late, name) for name in late.half_widths}
    least = min(fit_position_path(part, k, _OF_ROBOT, course, start).rms_error
                for course in COURSES)
    return bool(least**2 > FAR_BETTER * late.rms_error**2)


def _error_by_move(path: PositionPath, record: Record, k: int) -> np.ndarray:
    """RMS error of a path in each stretch of `MOVE_TIME` of a log [rad]."""
    error = prediction_error(path, record, k)
    width = _samples_of_move(record)
    blocks = error[:error.size // width * width].reshape(-1, width)
    return np.sqrt(np.mean(blocks**2, axis=1))


def _samples_of_move(record: Record) -> int:
    return max(1, round(MOVE_TIME / record.sample_time))
