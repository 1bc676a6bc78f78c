"""What the sensor noise alone makes of the prediction error, and the filter that whitens it.

White noise on the measured position goes round the loop: the error that is left is S0 n, with S0
the sensitivity of the loop.  Its covariance at the rate of the diagnosis follows from the impulse
response, and an autoregression of that covariance whitens every signal.  So chi^2 per sample is
absolute: 1 says that nothing but sensor noise is left.  What another encoder sees has noise of its
own, which does not go round the loop, and the motion (S0 - 1) n by which the joint follows that of
the law's encoder.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.sensor_noise import (
    LEAST_NOISE,
    noise_of_logs,
    sensor_noise,
    torque_noise,
)

RATE = 100.0  # Hz, rate at which errors are compared
ORDER = 20  # of the autoregression
_BLOCK = 16  # samples that are whitened by one product


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


def decimation(period: float) -> int:
    """Samples that are averaged into one before errors are compared."""
    return max(1, round(1.0 / (RATE * period)))


def decimated(x: np.ndarray, period: float) -> np.ndarray:
    """Means over neighbouring samples, along the first axis."""
    return block_means(x, decimation(period))


def block_means(x: np.ndarray, width: int) -> np.ndarray:
    """Means over blocks of samples, along the first axis."""
    rows = len(x) // width
    blocks = x[:rows * width].reshape(rows, width, -1)
    return (np.full(width, 1.0 / width) @ blocks).reshape(rows, *x.shape[1:])


class Rows(NamedTuple):
    """Rows in which the errors of a log are compared: each is a mean over some of its samples.

    Parameters
    ----------
    stride : int
        Ticks of the controller per sample.
    width : int
        Samples per row.

    """

    stride: int
    width: int

    @property
    def ticks(self) -> int:
        """Ticks of the controller per row."""
        return self.stride * self.width

    def of_samples(self, x: np.ndarray) -> np.ndarray:
        """Means over the samples of each row, of a signal at every tick."""
        return block_means(x[::self.stride], self.width)

    def of_ticks(self, x: np.ndarray) -> np.ndarray:
        """Means over all ticks of each row."""
        return block_means(x, self.ticks)


def rows_of(log: Log, period: float) -> Rows:
    """Rows of a log, at a period of the controller [s]."""
    return Rows(log.stride, decimation(period * log.stride))


def sensor_noise_model(problem: Problem, k: int, responses: Sequence[np.ndarray]) -> Noise:
    """Noise of joint k in the closed loop, of logs of the same encoder with the same rows.

    `responses` are the errors of joint k after a unit impulse on the sensor of each joint, see
    `sensitivity.noise_responses`.
    """
    sigma = [sensor_noise(problem, j) for j in range(problem.n)]
    responses, of_torque = list(responses[:problem.n]), responses[problem.n:]
    responses = [size * response for size, response in zip(sigma, responses)]
    responses += [torque_noise(problem, k) * response for response in of_torque]
    if problem.logs[0].of_other_encoder:
        impulse = np.eye(1, len(responses[k]))[0]
        own = max(noise_of_logs(problem, k, [log.q for log in problem.logs]), LEAST_NOISE)
        responses[k] = responses[k] - sigma[k] * impulse
        responses.append(own * impulse)
        sigma[k] = own
    floor, log = float(np.linalg.norm(responses)), problem.logs[0]
    unseen = np.count_nonzero(log.seen[::log.stride]) / len(log.sample_ticks) - 1.0
    if unseen > 0.0:  # a row rests on fewer samples than the loop reads in it
        responses.append(sigma[k] * np.sqrt(unseen) * np.eye(1, len(responses[k]))[0])
    rows = rows_of(log, problem.period)
    covariance = np.sum([_covariance(response, rows) for response in responses], axis=0)
    covariance[0] *= 1.0 + 1e-9
    lags = np.abs(np.subtract.outer(range(ORDER), range(ORDER)))
    predictor = np.linalg.solve(covariance[lags], covariance[1:])
    innovation = covariance[0] - predictor @ covariance[1:]
    return Noise(sigma=sigma[k], floor=floor,
                 whitener=np.concatenate(([1.0], -predictor)) / np.sqrt(innovation))


def _covariance(response: np.ndarray, rows: Rows) -> np.ndarray:
    """Covariance of the rows of a response to white noise, by lag."""
    weights = np.zeros(rows.stride * (rows.width - 1) + 1)
    weights[::rows.stride] = 1.0 / rows.width
    averaged = np.convolve(response, weights)
    lags = rows.ticks * np.arange(ORDER + 1)
    averaged = np.pad(averaged, (0, max(0, int(lags[-1]) + 1 - len(averaged))))
    return np.array([averaged[:len(averaged) - lag] @ averaged[lag:] for lag in lags])


def whiten(x: np.ndarray, whitener: np.ndarray) -> np.ndarray:
    """Whitened signal along the first axis, without the start of the filter.

    Blocks of samples are multiplied with one small matrix, several times as fast as a filter
    that goes from sample to sample.
    """
    past, blocks = len(whitener) - 1, -(-len(x) // _BLOCK)
    if not x.size:
        return x[past:]
    padded = np.zeros((blocks * _BLOCK + past, math.prod(x.shape[1:])))
    padded[:len(x)] = x.reshape(len(x), -1)
    step, one = padded.strides
    windows = as_strided(padded, (blocks, _BLOCK + past, padded.shape[1]),
                         (_BLOCK * step, step, one))
    return (_rows(whitener) @ windows).reshape(-1, *x.shape[1:])[:len(x) - past]


def _rows(whitener: np.ndarray) -> np.ndarray:
    """Filter of each sample of a block, shape (block, block + past)."""
    rows = np.zeros((_BLOCK, _BLOCK + len(whitener) - 1))
    for i, row in enumerate(rows):
        row[i:i + len(whitener)] = whitener[::-1]
    return rows
