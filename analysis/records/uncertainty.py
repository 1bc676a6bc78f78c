"""Least squares whose intervals hold when the residual is coloured, as a robot's always is."""

import dataclasses

import numpy as np

from clie_blocks.analysis.statistical_measures import NORMAL_95

BLOCKS = 30  # blocks of residual whose sums are taken as independent


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A least-squares estimate.

    Parameters
    ----------
    value : ndarray, shape (p,)
        Estimate.
    covariance : ndarray, shape (p, p)
        Its covariance.
    residual : ndarray, shape (N,)
        What is left.
    freedom : int
        Blocks less one, for the interval's quantile.

    """

    value: np.ndarray
    covariance: np.ndarray
    residual: np.ndarray
    freedom: int

    @property
    def interval(self) -> np.ndarray:
        """Half width of the 95 % interval."""
        return quantile95(self.freedom) * np.sqrt(np.maximum(np.diag(self.covariance), 0))


def least_squares(columns: np.ndarray, target: np.ndarray, instruments: np.ndarray | None = None,
                  blocks: int = BLOCKS) -> Fit:
    """Least squares, or instrumental variables, with block-robust uncertainty.

    The scores ``z_k r_k`` are summed over blocks much longer than the residual's memory; the
    spread of the sums, not of the samples, gives the covariance.

    Parameters
    ----------
    columns : ndarray, shape (N, p)
        Regressor, in the order of time.
    target : ndarray, shape (N,)
        What it explains.
    instruments : ndarray, shape (N, p), optional
        Signals free of the noise in `columns`; by default the columns themselves.
    blocks : int
        Number of blocks.

    Returns
    -------
    Fit
        Estimate, covariance and residual.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the columns are not independent.

    """
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0, size, 1.0)
    scaled = columns / size
    z = scaled if instruments is None else instruments / np.linalg.norm(instruments, axis=0)
    inverse = np.linalg.inv(z.T @ scaled)
    value = inverse @ (z.T @ target)
    residual = target - scaled @ value
    middle, freedom = block_covariance(z * residual[:, None], blocks)
    covariance = inverse @ middle @ inverse.T / np.outer(size, size)
    return Fit(value / size, covariance, residual, freedom)


def quantile95(freedom: int) -> float:
    """Two-sided 95 % quantile of Student's t, by the first terms of its expansion."""
    first = (NORMAL_95**3 + NORMAL_95) / 4
    second = (5 * NORMAL_95**5 + 16 * NORMAL_95**3 + 3 * NORMAL_95) / 96
    return NORMAL_95 + first / freedom + second / freedom**2


def block_covariance(scores: np.ndarray, blocks: int = BLOCKS) -> tuple[np.ndarray, int]:
    """Covariance of the sum of coloured scores, from their sums over blocks, and its freedom."""
    edges = np.linspace(0, len(scores), blocks + 1).astype(int)[:-1]
    sums = np.add.reduceat(scores, edges, axis=0)
    return sums.T @ sums * blocks / (blocks - 1), blocks - 1
