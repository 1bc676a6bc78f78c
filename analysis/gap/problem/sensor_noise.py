"""Noise of the encoders, by what a log holds above all motion."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.linear_filters import high_pass

LEAST_NOISE = 1e-9  # rad, of an encoder
TOO_FAST = 0.5  # of the noise of a position: what the reference explains of it is motion
_NOISE_CORNER = 60.0  # Hz, or this share of the sample rate: above it there is no motion,
_NOISE_CORNER_SHARE = 0.24
_MAD = 0.6745  # median of the absolute value of a standard normal variable
_OFF_LINE = np.array([1.0, -2.0, 1.0])  # weights of what a line, or a cubic, through its
_OFF_CUBIC = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0  # neighbours misses of a sample
_START_UP = 300  # and so many samples at both ends belong to the filter that looks there


def sensor_noise(problem: Problem, k: int) -> float:
    """Standard deviation of the noise of the law's encoder at joint k [rad].

    It is known from what lies above all motion.  Where a joint moves too fast for the rate of its
    log, that is found beside the reference, which holds the same motion without the noise.
    """
    whole_band = noise_of_logs(problem, k, [log.law_q for log in problem.logs])
    slow = any(log.stride > 1 for log in problem.logs) and problem.law.holds_joints
    is_led = any(np.array_equal(log.q_d, log.q) for log in problem.logs)  # by an observer
    if slow and not is_led:
        beside = noise_of_logs(problem, k, [log.law_q - log.q_d for log in problem.logs])
        whole_band = beside if beside < TOO_FAST * whole_band else whole_band
    quantum = problem.resolution[k] / np.sqrt(12)
    return max(whole_band, quantum, LEAST_NOISE)


def noise_of_logs(problem: Problem, k: int, positions: Sequence[np.ndarray]) -> float:
    """Median over the logs of the noise of positions of joint k [rad]."""
    return float(np.median([_noise_of_log(log, q[:, k], problem.period)
                            for log, q in zip(problem.logs, positions)]))


def torque_noise(problem: Problem, k: int) -> float:
    """Noise of a measured torque of joint k that drives models, as impulses of a tick [N m].

    It is known from second differences, which no slow torque has, or, where a torque goes on
    between its samples, from what a cubic through its neighbours misses of each.  There a sample
    lasts `stride` ticks, and the torque has as much noise of its own in each.
    """
    return float(np.median([
        _roughness(log.u[::log.stride, k], log.stride > 1)
        * (1.0 if log.stride == 1 else np.sqrt(log.stride + 1.0)) for log in problem.logs]))


def _roughness(torque: np.ndarray, is_interpolated: bool) -> float:
    """Standard deviation of white noise in samples (N,) of a torque, robust to its jumps."""
    weights = _OFF_CUBIC if is_interpolated else _OFF_LINE
    off = np.convolve(torque, weights, "valid")
    return float(np.median(np.abs(off)) / (_MAD * np.linalg.norm(weights)))


def _noise_of_log(log: Log, q: np.ndarray, period: float) -> float:
    """Standard deviation of the noise of a position (N,) in one log, over its whole band [rad]."""
    if log.usual_step > log.stride:
        return _noise_of_uneven_samples(log.sample_ticks, q[log.sample_ticks])
    rate = 1.0 / (period * log.stride)
    corner = min(_NOISE_CORNER, _NOISE_CORNER_SHARE * rate)
    fast = high_pass(q[::log.stride], 4, corner, rate)
    away = min(_START_UP, len(fast) // 4)
    inner: slice | np.ndarray = slice(away, -away)
    if log.counted is not None:
        inner = np.flatnonzero(log.counted)[inner]
    return float(np.sqrt(np.mean(fast[inner] ** 2)) / np.sqrt(1.0 - 2 * corner / rate))


def _noise_of_uneven_samples(ticks: np.ndarray, q: np.ndarray) -> float:
    """Noise of samples q at uneven ticks: what a cubic through four neighbours misses of each."""
    neighbours = (-2, -1, 1, 2)
    inner = np.arange(2, len(ticks) - 2)
    at = {i: (ticks[inner + i] - ticks[inner]).astype(float) for i in neighbours}
    weights = [np.prod([at[j] / (at[j] - at[i]) for j in neighbours if j != i], axis=0)
               for i in neighbours]
    miss = q[inner] - sum(w * q[inner + i] for w, i in zip(weights, neighbours))
    size = miss / np.sqrt(1.0 + np.sum(np.square(weights), axis=0))
    return float(np.median(np.abs(size)) / _MAD)
