"""What a measured signal holds above all motion: the noise of its sensor.

A filter separates the two where the motion is slow.  A light joint that rings after a step moves
above the corner, too.  But noise is about as large all the time: what is far larger than usual
for a moment is motion, and a model that took it for noise would ring along with it.  For that
moment noise is what lies above a higher corner.
"""

import numpy as np

from clie_blocks.linear_filters import high_pass

HIGHEST_CORNER_SHARE = 0.2  # of the sample rate: the highest corner that a filter may have
_ORDER = 2
_MOMENT = 0.1  # s over which the size of noise is taken, but so many samples at least
_LEAST_SAMPLES = 10
_FAR_LARGER = 3.0  # than usual: noise over a moment differs from that by its statistics, a third


def noise_above_motion(x: np.ndarray, corner: float, rate: float) -> np.ndarray:
    """Return the noise of signals, at each moment what lies above the motion then.

    It is zero where they move too fast for any corner.

    Parameters
    ----------
    x : ndarray, shape (N, n)
        Signals.
    corner : float
        Frequency above which there is no slow motion [Hz].
    rate : float
        Sampling rate [Hz].

    """
    highest = HIGHEST_CORNER_SHARE * rate
    fast = high_pass(x, _ORDER, min(corner, highest), rate)
    usual = _is_usual(fast, x, rate)
    noise = np.where(usual, fast, 0.0)
    while not usual.all() and corner < highest:
        corner = min(2.0 * corner, highest)
        fast = high_pass(x, _ORDER, corner, rate)
        now = ~usual & _is_usual(fast, x, rate)
        noise, usual = np.where(now, fast, noise), usual | now
    return noise


def _is_usual(fast: np.ndarray, x: np.ndarray, rate: float) -> np.ndarray:
    """Whether what signals (N, n) hold above a corner is about as large as at most other times.

    An encoder that rests between two counts is not without noise.
    """
    samples = max(_LEAST_SAMPLES, round(_MOMENT * rate))
    power = _moving_mean(fast**2, samples)
    usual = np.maximum(np.median(power, axis=0), _count(x) ** 2 / 12.0)
    return np.asarray(power <= _FAR_LARGER**2 * usual)


def _moving_mean(x: np.ndarray, samples: int) -> np.ndarray:
    """Mean over so many samples around each, shape (N, n); over fewer at the ends."""
    sums = np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)])
    middle = np.arange(len(x))
    first = np.maximum(middle - samples // 2, 0)
    end = np.minimum(middle - samples // 2 + samples, len(x))
    return (sums[end] - sums[first]) / (end - first)[:, None]


def _count(x: np.ndarray) -> np.ndarray:
    """Smallest change of signals from sample to sample, shape (n,): the count of an encoder."""
    steps = np.abs(np.diff(x, axis=0))
    least = np.min(steps, axis=0, initial=np.inf, where=steps > 0.0)
    return np.where(np.isfinite(least), least, 0.0)
