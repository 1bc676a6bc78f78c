"""Regression of a whitened error on the columns of one or more causes, from their Gram matrix.

A search asks for thousands of small regressions, so all of one size are solved together.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.search.screening import Column

_RIDGE = 1e-6  # on columns of norm one: two that are the same share what they explain
_FREE, _AT_LOWER, _AT_UPPER = range(3)  # what a coefficient may be


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
    limits : ndarray, shape (2, columns)
        Bounds of the coefficients; those of sets without amplitudes do not count.

    """

    columns: list[Column]
    gram: np.ndarray
    right: np.ndarray
    slices: list[slice]
    limits: np.ndarray

    def gains(self, groups: Sequence[Sequence[int]]) -> list[Gain]:
        """Return the gain of the sets of each group together, by position in `columns`.

        A set without amplitudes is one column with coefficient one.
        """
        places = [self._places(sets) for sets in groups]
        by_size: dict[tuple[int, int], list[int]] = {}
        for i, (pinned, scaled) in enumerate(places):
            by_size.setdefault((len(pinned), len(scaled)), []).append(i)
        gains: dict[int, Gain] = {}
        for some in by_size.values():
            drops, thetas = self._drops(*(np.array([places[i][part] for i in some], int)
                                          for part in range(2)))
            gains |= {i: Gain(float(drop), self._by_set(groups[i], theta))
                      for i, drop, theta in zip(some, drops, thetas)}
        return [gains[i] for i in range(len(groups))]

    def _places(self, sets: Sequence[int]) -> tuple[list[int], list[int]]:
        """Columns with coefficient one, and columns that are scaled."""
        pinned = [self.slices[i].start for i in sets if not self.columns[i].amplitudes]
        scaled = [place for i in sets if self.columns[i].amplitudes
                  for place in range(self.slices[i].start, self.slices[i].stop)]
        return pinned, scaled

    def _drops(self, pinned: np.ndarray, scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Drops and coefficients of groups of one size, whose columns are the rows."""
        rows = scaled[:, :, None]
        drop = 2 * self.right[pinned].sum(axis=1) - self.gram[
            pinned[:, :, None], pinned[:, None]].sum(axis=(1, 2))
        right = self.right[scaled] - self.gram[rows, pinned[:, None]].sum(axis=2)
        more, theta = bounded_drops(self.gram[rows, scaled[:, None]], right,
                                    *self.limits[:, scaled])
        return drop + more, theta

    def _by_set(self, sets: Sequence[int], theta: np.ndarray) -> tuple[tuple[float, ...], ...]:
        coefficients = iter(theta.tolist())
        return tuple(tuple(itertools.islice(coefficients, len(self.columns[i].amplitudes)))
                     for i in sets)


def regression(columns: Sequence[Column], target: np.ndarray) -> Regression:
    """Return the `Regression` of a target on column sets of one joint, or stacked ones."""
    data = np.concatenate([column.data for column in columns], axis=1)
    ends = np.cumsum([0] + [column.data.shape[1] for column in columns])
    slices = [slice(first, last) for first, last in itertools.pairwise(ends)]
    limits = np.zeros((2, data.shape[1]))
    for column, place in zip(columns, slices):
        if column.amplitudes:
            limits[:, place] = column.limits
    return Regression(list(columns), data.T @ data, data.T @ target, slices, limits)


def bounded_drops(gram: np.ndarray, right: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                  ) -> tuple[np.ndarray, np.ndarray]:
    """Least squares within bounds, many: the drops of the sum of squares, and the coefficients.

    Each coefficient is free or at one of its bounds.  The best of all such choices whose free
    coefficients are inside their bounds is the optimum; four columns have few of them.

    Parameters
    ----------
    gram : ndarray, shape (M, k, k)
        Matrices of the normal equations.
    right : ndarray, shape (M, k)
        Their right-hand sides.
    lower, upper : ndarray, shape (M, k)
        Bounds of the coefficients, infinite where there are none; zero is within them.

    """
    norm = np.sqrt(np.diagonal(gram, axis1=1, axis2=2)) + 1e-30
    gram, right = gram / (norm[:, :, None] * norm[:, None]), right / norm
    lower, upper = lower * norm, upper * norm
    curved = gram + _RIDGE * np.eye(norm.shape[1])
    theta = _solved(curved, right)
    beyond = ((theta < lower) | (theta > upper)).any(axis=1)
    if beyond.any():
        theta[beyond] = _best_at_bounds(curved[beyond], right[beyond], lower[beyond],
                                        upper[beyond])
    return _drop(gram, right, theta), theta / norm


def _best_at_bounds(gram: np.ndarray, right: np.ndarray, lower: np.ndarray, upper: np.ndarray,
                    ) -> np.ndarray:
    """Best coefficients inside bounds, some of which must be active."""
    best, theta = np.zeros(len(right)), np.zeros(right.shape)
    for choice in itertools.product((_FREE, _AT_LOWER, _AT_UPPER), repeat=right.shape[1]):
        kind = np.array(choice)
        held = np.where(kind == _AT_LOWER, lower, np.where(kind == _AT_UPPER, upper, 0.0))
        bounded = np.all(np.isfinite(held), axis=1)
        if not bounded.any():
            continue
        tried, free = np.where(bounded[:, None], held, 0.0), kind == _FREE
        if free.any():
            tried[:, free] = _solved(gram[:, free][:, :, free],
                                     (right - _product(gram, tried))[:, free])
        inside = ((tried >= lower) & (tried <= upper)).all(axis=1)
        drop = _drop(gram, right, tried)
        better = np.flatnonzero(bounded & inside & np.greater(drop, best))
        best[better], theta[better] = drop[better], tried[better]
    return theta


def _solved(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.linalg.solve(matrices, right[..., None])[..., 0]


def _product(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return (matrices @ vectors[..., None])[..., 0]


def _drop(gram: np.ndarray, right: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Drop of the sum of squares at some coefficients."""
    return (theta * (2 * right - _product(gram, theta))).sum(axis=1)
