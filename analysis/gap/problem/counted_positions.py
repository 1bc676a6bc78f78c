"""Positions between the counts of an encoder that is coarser than stated.

A count says where a joint is to half a step, but when it changes, it says so exactly.  A cubic
spline through the changes knows the motion between them better than the counts do; what the counts
add to it is known too, and moves the robot through its law.
"""

import dataclasses
from collections.abc import Collection

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem

_CHANGES = 4  # of the count, from which a spline goes through them
_BRIEF = 0.25  # of the time to its nearer neighbour, that a crossing to and fro takes at most


def with_positions_between_counts(problem: Problem, joints: Collection[int], step: np.ndarray,
                                  ) -> Problem:
    """Return the problem with positions between the counts of some joints, where that can be.

    Parameters
    ----------
    problem : Problem
        With the logged positions.
    joints : collection of int
        Those with coarse encoders.
    step : ndarray, shape (n,)
        Steps of the encoders [rad].

    """
    coarse = [k for k in joints if step[k] > 0.0]
    if not coarse or not can_read_between_counts(problem):
        return problem
    is_coarse = np.isin(np.arange(problem.n), coarse)

    def read(log: Log) -> Log:
        rounding = np.zeros_like(log.q)
        for k in coarse:
            rounding[:, k] = log.q[:, k] - between_counts(log.q[:, k], step[k])
        return dataclasses.replace(log, q=log.q - rounding, rounding=rounding,
                                   dither=np.where(is_coarse, rounding, log.dither))

    resolution = np.where(is_coarse, step, problem.resolution)
    return dataclasses.replace(problem.with_logs(read), resolution=resolution)


def can_read_between_counts(problem: Problem) -> bool:
    """Whether logs of a robot, not of a simulator, show each change of a count of its encoders.

    Which of two encoders counts is another question.
    """
    return not (problem.simulated or problem.two_encoders) and all(
        log.shows_every_tick and log.measured is None for log in problem.logs)


def between_counts(q: np.ndarray, step: float) -> np.ndarray:
    """Position (N,) between the counts of an encoder, within half a step of them [rad].

    At a change it is in the middle of both counts, half a sample after the first of them.
    """
    changes = np.flatnonzero(np.abs(np.diff(q)) > 0.5 * step)
    if len(changes) < _CHANGES:
        return q
    from scipy.interpolate import CubicSpline

    at, middle = _crossings(changes + 0.5, (q[changes] + q[changes + 1]) / 2.0, step)
    at, middle = np.append(at, len(q) - 1.0), np.append(middle, q[-1])
    if changes[0] > 0:
        at, middle = np.insert(at, 0, 0.0), np.insert(middle, 0, q[0])
    return np.clip(CubicSpline(at, middle)(np.arange(len(q))), q - step / 2.0, q + step / 2.0)


def _crossings(at: np.ndarray, middle: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Changes (M,) with those of one brief crossing, to and fro by noise, as one in their midst.

    A spline through each of them would stand still there, and swing to either side.
    """
    first = np.flatnonzero(np.abs(np.diff(middle, prepend=np.inf)) > 0.5 * step)
    begin, end = at[first], at[np.append(first[1:], len(at)) - 1]
    apart = begin[1:] - end[:-1]
    room = np.minimum(np.append(apart, np.inf), np.insert(apart, 0, np.inf))
    is_brief, midst = (np.repeat(of_crossing, np.diff(np.append(first, len(at))))
                       for of_crossing in (end - begin < _BRIEF * room, (begin + end) / 2))
    kept = ~is_brief
    kept[first] = True
    return np.where(is_brief, midst, at)[kept], middle[kept]
