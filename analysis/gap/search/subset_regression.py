"""Regression of a whitened error on the columns of one or more causes, from their Gram matrix."""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.search.screening import Column

_RIDGE = 1e-6  # on columns of norm one: two that are the same share what they explain
_FREE = np.nan  # in the place of a bound


@dataclasses.dataclass(frozen=True)
class Gain:
    """What columns explain: the drop of chi^2, and the coefficients of each set that reach it."""

    drop: float
    theta: tuple[tuple[float, ...], ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Regression:
    """Gram matrix of many column sets at one joint, and their products with the error.

    Parameters
    ----------
    columns : list of Column
        Column sets.
    gram, right : ndarray
        Products of all columns with each other and with the error.
    slices : list of slice
        Where each set lies.

    """

    columns: list[Column]
    gram: np.ndarray
    right: np.ndarray
    slices: list[slice]

    def gain(self, *sets: int) -> Gain:
        """Return the gain of some sets together, by position in `columns`.

        A set without amplitudes is one column with coefficient one.
        """
        pinned = [self.slices[i].start for i in sets if not self.columns[i].amplitudes]
        scaled = [i for i in sets if self.columns[i].amplitudes]
        drop = float(2 * self.right[pinned].sum() - self.gram[np.ix_(pinned, pinned)].sum())
        theta = np.zeros(0)
        if scaled:
            used = np.concatenate([np.arange(self.slices[i].start, self.slices[i].stop)
                                   for i in scaled])
            right = self.right[used] - self.gram[np.ix_(used, pinned)].sum(axis=1)
            lower, upper = np.concatenate([self.columns[i].limits for i in scaled], axis=1)
            more, theta = bounded_drop(self.gram[np.ix_(used, used)], right, lower, upper)
            drop += more
        coefficients = iter(theta)
        return Gain(drop, tuple(tuple(itertools.islice(coefficients,
                                                       len(self.columns[i].amplitudes)))
                                for i in sets))


def regression(columns: Sequence[Column], target: np.ndarray) -> Regression:
    """Return the `Regression` of a target on column sets of one joint, or stacked ones."""
    data = np.concatenate([column.data for column in columns], axis=1)
    ends = np.cumsum([0] + [column.data.shape[1] for column in columns])
    return Regression(list(columns), data.T @ data, data.T @ target,
                      [slice(first, last) for first, last in itertools.pairwise(ends)])


def bounded_drop(gram: np.ndarray, right: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                 ) -> tuple[float, np.ndarray]:
    """Least squares within bounds: the drop of the sum of squares, and the coefficients.

    Each coefficient is free or at one of its bounds.  The best of all such choices whose free
    coefficients are inside their bounds is the optimum; four columns have few of them.

    Parameters
    ----------
    gram, right : ndarray
        Normal equations.
    lower, upper : ndarray
        Bounds of the coefficients, infinite where there are none; zero is within them.

    """
    norm = np.sqrt(np.diag(gram)) + 1e-30
    gram, right = gram / np.outer(norm, norm), right / norm
    lower, upper = lower * norm, upper * norm
    curved = gram + _RIDGE * np.eye(len(norm))
    theta = np.linalg.solve(curved, right)
    if (theta < lower).any() or (theta > upper).any():
        theta = _best_at_bounds(curved, right, lower, upper)
    return float(2 * theta @ right - theta @ gram @ theta), theta / norm


def _best_at_bounds(gram: np.ndarray, right: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                    ) -> np.ndarray:
    """Best coefficients inside bounds, some of which must be active."""
    best, theta = 0.0, np.zeros(len(right))
    options = [[_FREE, *filter(math.isfinite, bounds)] for bounds in zip(lower, upper)]
    for held in itertools.product(*options):
        tried = np.array(held)
        free = np.isnan(tried)
        tried[free] = 0.0
        if free.any():
            tried[free] = np.linalg.solve(gram[free][:, free], right[free] - gram[free] @ tried)
            if (tried < lower).any() or (tried > upper).any():
                continue
        drop = float(tried @ (2 * right - gram @ tried))
        if drop > best:
            best, theta = drop, tried
    return theta
