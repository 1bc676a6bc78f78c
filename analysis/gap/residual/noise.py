"""What the sensor noise alone makes of the prediction error, and the filter that whitens it.

White noise on the measured position goes round the loop: the error that is left is S0 n, with S0
the sensitivity of the loop.  Its covariance at the rate of the diagnosis follows from the impulse
response, and an autoregression of that covariance whitens every signal.  So chi^2 per sample is
absolute: 1 says that nothing but sensor noise is left.
"""

import dataclasses
import math

import numpy as np
from numpy.lib.stride_tricks import as_strided

from clie_blocks.linear_filters import high_pass

ORDER = 20
RATE = 100.0  # Hz, rate at which errors are judged
BLOCK = 16  # samples that are whitened by one product


@dataclasses.dataclass(frozen=True, eq=False)
class Noise:
    """Sensor noise of one joint and its whitening filter.

    Parameters
    ----------
    sigma : float
        Standard deviation of the sensor noise [rad].
    floor : float
        RMS of the error that it leaves in the loop, at the rate of the log [rad].
    whitener : ndarray
        Filter that makes the decimated error white with variance one.

    """

    sigma: float
    floor: float
    whitener: np.ndarray


def decimation(period):
    """Samples that are averaged into one before errors are judged."""
    return max(1, round(1.0 / (RATE * period)))


def decimated(x, period):
    """Means over neighbouring samples, along the first axis."""
    width = decimation(period)
    rows = len(x) // width
    blocks = x[:rows * width].reshape(rows, width, -1)
    return (np.full(width, 1.0 / width) @ blocks).reshape(rows, *x.shape[1:])


def sensor_noise(problem, k):
    """Standard deviation of the noise of joint k, from what lies above all motion [rad]."""
    rate = 1.0 / problem.period
    corner = min(60.0, 0.24 * rate)
    found = [np.sqrt(np.mean(high_pass(log.q[:, k], 4, corner, rate)[300:-300] ** 2))
             for log in problem.logs]
    quantum = problem.resolution[k] / np.sqrt(12)
    return max(float(np.median(found)) / np.sqrt(1.0 - 2 * corner / rate), quantum, 1e-9)


def sensor_noise_model(problem, k, responses):
    """Noise of joint k in the closed loop.

    Parameters
    ----------
    problem : Problem
        The logs.
    k : int
        Joint.
    responses : list of ndarray
        Error of joint k after a unit impulse on each sensor, see `sensitivity.noise_responses`.

    """
    sigma = [sensor_noise(problem, j) for j in range(problem.n)]
    responses = [size * response for size, response in zip(sigma, responses)]
    width = decimation(problem.period)
    covariance = sum(_covariance(response, width) for response in responses)
    covariance[0] *= 1.0 + 1e-9
    lags = np.abs(np.subtract.outer(range(ORDER), range(ORDER)))
    predictor = np.linalg.solve(covariance[lags], covariance[1:])
    left = covariance[0] - predictor @ covariance[1:]
    return Noise(sigma=sigma[k], floor=float(np.linalg.norm(responses)),
                 whitener=np.concatenate(([1.0], -predictor)) / np.sqrt(left))


def _covariance(response, width):
    """Covariance of the decimated response to white noise, by lag."""
    averaged = np.convolve(response, np.full(width, 1.0 / width))
    return np.array([averaged[:len(averaged) - lag] @ averaged[lag:]
                     for lag in range(0, (ORDER + 1) * width, width)])


def whiten(x, whitener):
    """Whitened signal along the first axis, without the start of the filter.

    Blocks of samples are multiplied with one small matrix, several times as fast as a filter
    that goes from sample to sample.
    """
    past, blocks = len(whitener) - 1, -(-len(x) // BLOCK)
    padded = np.zeros((blocks * BLOCK + past, math.prod(x.shape[1:])))
    padded[:len(x)] = x.reshape(len(x), -1)
    step, one = padded.strides
    windows = as_strided(padded, (blocks, BLOCK + past, padded.shape[1]),
                         (BLOCK * step, step, one))
    return (_rows(whitener) @ windows).reshape(-1, *x.shape[1:])[:len(x) - past]


def _rows(whitener):
    """Filter of each sample of a block, shape (BLOCK, BLOCK + past)."""
    rows = np.zeros((BLOCK, BLOCK + len(whitener) - 1))
    for i, row in enumerate(rows):
        row[i:i + len(whitener)] = whitener[::-1]
    return rows
