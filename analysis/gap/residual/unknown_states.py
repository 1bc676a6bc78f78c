"""What an unknown state makes of a prediction error: at the start of a log, and behind its gaps.

A log that was cut out of a longer run begins in an unknown state.  In a gap the robot went on
under commands that were not logged, which leaves an unknown state behind it.  To first order both
are responses of known shape and unknown size; a residual is what they do not explain.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import ORDER, Noise, Rows, rows_of, whiten
from clie_blocks.linear_filters import lfilter

LEAST_MEASURED = 0.5  # share of the samples of a row that counts
VISIBLE = 0.3  # standard deviations of white noise, below which an unlogged torque pulse is not
CUBIC = np.array([-1.0, 9.0, 9.0, -1.0]) / 16  # weights of samples beside the one in the middle
STEP_ON_CURVE = 8.0  # half a step of a signal, over the error of a curve next to it
MOST_FREE = 0.05  # of the rows of a log: so many responses behind gaps are free at most
INDEPENDENT = 1e-6  # of the largest singular value: less is the same response twice


def counted_rows(log: Log, period: float) -> np.ndarray | None:
    """Whitened rows that rest on measured samples, and on none that is mostly filled in.

    None where all do.
    """
    if log.counted is None:
        return None
    rows = rows_of(log, period)
    seen = rows.of_samples(log.seen.astype(float)) >= LEAST_MEASURED
    return whiten((~seen).astype(float), np.ones(ORDER + 1)) == 0.0


def counted_part(x: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    """Whitened signal (or columns) with zeros where a row does not count."""
    return x if counted is None else x * counted.reshape(-1, *[1] * (x.ndim - 1))


def unknown_responses(problem: Problem, inertia: np.ndarray, damping: np.ndarray, k: int, log: Log,
                      noise: Noise) -> np.ndarray:
    """Orthonormal whitened responses of joint k to what is not known of a log, (rows, m)."""
    rows, counted = rows_of(log, problem.period), counted_rows(log, problem.period)
    first = _initial_responses(problem, inertia, damping, k, len(log))
    zero = np.ones((len(log), int(log.of_other_encoder)))  # of an encoder beside the law's
    white = whiten(rows.of_samples(np.hstack([first, zero])), noise.whitener)
    if counted is None and log.shows_every_tick:
        return _orthonormal(white)
    ahead = np.pad(first[:, 0], (ORDER * rows.ticks, 0))[:len(first)]
    least = VISIBLE / float(np.linalg.norm(whiten(rows.of_samples(ahead), noise.whitener)))
    unknown = [*_behind_gaps(problem, k, log, rows), *_steps(problem, k, log)]
    largest = sorted((one for one in unknown if one.size > least), reverse=True)
    behind = [_shifted(first[:, :one.columns], one.at, rows, noise)
              for one in largest[:int(MOST_FREE * len(white))]]
    return _independent(counted_part(np.concatenate([white, *behind], axis=1), counted))


def responses_to_cuts(problem: Problem, inertia: np.ndarray, damping: np.ndarray, k: int, log: Log,
                      ) -> np.ndarray:
    """Orthonormal responses of joint k to the unknown state behind each cut of a log, (N, m)."""
    first = _initial_responses(problem, inertia, damping, k, len(log))
    columns = [np.pad(first, ((at, 0), (0, 0)))[:len(log)] for at in log.cuts]
    return _orthonormal(np.concatenate(columns, axis=1))


def _initial_responses(problem: Problem, inertia: np.ndarray, damping: np.ndarray, k: int,
                       samples: int) -> np.ndarray:
    """Responses of the measured position to an initial speed and an initial position, (N, 2)."""
    kick = np.zeros(samples)
    kick[0] = 1.0
    b, a = problem.law.torque_sensitivity(k, inertia[k], damping[k])
    displaced = lfilter(*problem.law.sensor_sensitivity(k, inertia[k], damping[k]),
                        np.ones(samples))
    return np.stack([lfilter(b, a, kick), displaced], axis=1)


def _shifted(response: np.ndarray, at: int, rows: Rows, noise: Noise) -> np.ndarray:
    """Whitened response (N, m) to what happened at another tick than the first."""
    shifted = np.pad(response, ((at, 0), (0, 0)))[:len(response)]
    return whiten(rows.of_samples(shifted), noise.whitener)


class _Unknown(NamedTuple):
    """What is not known of a log at one of its ticks.

    Parameters
    ----------
    size : float
        Torque that may be missing, times the ticks for which it acted [N m].
    at : int
        The tick.
    columns : int
        1 for a pulse of torque, 2 for any speed and position.

    """

    size: float
    at: int
    columns: int


def _behind_gaps(problem: Problem, k: int, log: Log, rows: Rows) -> list[_Unknown]:
    """What each gap leaves: a pulse of torque within one row, any state behind a longer one."""
    torque = problem.law.kp[k] * log.q_d[:, k] + log.pe[:, k]
    return [_Unknown(np.inf, behind, 2) if behind - before > rows.ticks
            else _Unknown(unlogged_pulse(torque, before, behind, log), before, 1)
            for before, behind in log.gaps]


def _steps(problem: Problem, k: int, log: Log) -> list[_Unknown]:
    """Steps of the command between two samples: when they came is not known to the tick."""
    if log.shows_every_tick:
        return []
    ticks = log.sample_ticks
    between = np.diff(ticks)
    step = problem.law.kp[k] * _held_steps(log.q_d[:, k], ticks) + _held_steps(log.pe[:, k], ticks)
    return [_Unknown(float(abs(step[i]) * between[i]) / 2, int(ticks[i] + between[i] // 2), 1)
            for i in np.flatnonzero(step * (between <= log.usual_step)).tolist()]


def _held_steps(signal: np.ndarray, ticks: np.ndarray) -> np.ndarray:
    """Steps behind each sample but the last of a signal that is held up to the next; else zero."""
    first, last, after = signal[ticks[:-1]], signal[ticks[1:] - 1], signal[ticks[1:]]
    return np.where(first == last, after - first, 0.0)


def unlogged_pulse(torque: np.ndarray, before: int, behind: int, log: Log) -> float:
    """How far a commanded torque (N,) may be from what stands in a gap, times its ticks [N m].

    Of a single sample, the samples beside it tell how well a curve predicts one of them, or that
    the command made a step; of more, the slopes on both sides.  Infinite where too few are known.
    """
    step, ticks = log.stride, behind - before
    if ticks == 2 * step:  # never in a log of uneven steps
        return STEP_ON_CURVE * ticks * max(_miss_of_curve(torque, before - step, log),
                                           _miss_of_curve(torque, behind + step, log))
    known = log.sample_ticks
    i = int(np.searchsorted(known, before))
    if i == 0 or i + 2 == len(known):
        return np.inf
    earlier, later = int(known[i - 1]), int(known[i + 2])
    if max(before - earlier, later - behind) > log.usual_step:
        return np.inf
    slopes = ((torque[before] - torque[earlier]) / (before - earlier),
              (torque[later] - torque[behind]) / (later - behind))
    jump = torque[behind] - torque[before] - ticks * (slopes[0] + slopes[1]) / 2
    bend = (slopes[1] - slopes[0]) * ticks / 8
    return float((abs(jump) / 2 + abs(bend)) * ticks)


def _miss_of_curve(torque: np.ndarray, at: int, log: Log) -> float:
    """Error of a cubic through four neighbours of a sample; infinite where one is not known."""
    near = at + log.stride * np.array([-3, -1, 1, 3])
    if not _are_known(log, np.append(near, at)):
        return np.inf
    return float(abs(torque[at] - CUBIC @ torque[near]))


def _are_known(log: Log, at: np.ndarray) -> bool:
    """Whether samples at some ticks were measured."""
    inside = at[0] >= 0 and at.max() < len(log)
    return bool(inside and np.asarray(log.measured)[at].all())


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    return np.linalg.qr(columns / _sizes(columns))[0]


def _independent(columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span some columns, of which several may be the same."""
    left, singular, _ = np.linalg.svd(columns / _sizes(columns), full_matrices=False)
    kept = singular > INDEPENDENT * singular.max(initial=0.0)
    return left[:, kept]


def _sizes(columns: np.ndarray) -> np.ndarray:
    return np.sqrt((columns**2).sum(axis=0)) + 1e-300


def shared_rows(logs: Sequence[Log], period: float) -> list[list[int]]:
    """Logs of one encoder with the same rows, by index."""
    groups: dict[tuple[Rows, bool], list[int]] = {}
    for j, log in enumerate(logs):
        groups.setdefault((rows_of(log, period), log.of_other_encoder), []).append(j)
    return list(groups.values())
