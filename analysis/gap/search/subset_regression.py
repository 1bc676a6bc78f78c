"""Regression of a whitened error on the columns of one or more causes, from their Gram matrix."""

import dataclasses
import itertools

import numpy as np

RIDGE = 1e-6


@dataclasses.dataclass(frozen=True)
class Gain:
    """What columns explain: the drop of chi^2, and the coefficients of each set that reach it."""

    drop: float
    theta: tuple


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

    columns: list
    gram: np.ndarray
    right: np.ndarray
    slices: list

    def gain(self, *sets):
        """Return the gain of some sets together, by position in `columns`."""
        pinned = [self.slices[i].start for i in sets if not self.columns[i].amplitudes]
        scaled = [i for i in sets if self.columns[i].amplitudes]
        drop = float(2 * self.right[pinned].sum() - self.gram[np.ix_(pinned, pinned)].sum())
        at = np.concatenate([np.arange(self.slices[i].start, self.slices[i].stop)
                             for i in scaled]).astype(int) if scaled else np.zeros(0, int)
        theta = np.zeros(0)
        if scaled:
            right = self.right[at] - self.gram[np.ix_(at, pinned)].sum(axis=1)
            limits = np.concatenate([self.columns[i].limits for i in scaled], axis=1)
            more, theta = bounded_drop(self.gram[np.ix_(at, at)], right, *limits)
            drop += more
        parts, taken = [], 0
        for i in sets:
            width = len(self.columns[i].amplitudes)
            parts.append(tuple(theta[taken:taken + width]))
            taken += width
        return Gain(drop, tuple(parts))


def regression(columns, target):
    """Return the `Regression` of a target on column sets of one joint, or stacked ones."""
    data = np.concatenate([column.data for column in columns], axis=1)
    ends = np.cumsum([0] + [column.data.shape[1] for column in columns])
    return Regression(list(columns), data.T @ data, data.T @ target,
                      [slice(a, b) for a, b in zip(ends, ends[1:])])


def bounded_drop(gram, right, lower, upper):
    """Least squares with signs and bounds: the best of all active sets, drawn in to its bounds.

    Parameters
    ----------
    gram, right : ndarray
        Normal equations.
    lower, upper : ndarray
        Bounds of the coefficients; a lower bound of zero is a sign, the others are drawn in to.

    Returns
    -------
    drop : float
        Drop of the sum of squares.
    theta : ndarray
        Coefficients.

    """
    norm = np.sqrt(np.diag(gram)) + 1e-30
    gram, right = gram / np.outer(norm, norm), right / norm
    best, theta = 0.0, np.zeros(len(norm))
    signed = np.flatnonzero(lower == 0.0)
    for count in range(len(signed) + 1):
        for out in itertools.combinations(signed, count):
            used = np.array([i for i in range(len(norm)) if i not in out], int)
            if not used.size:
                continue
            part = gram[np.ix_(used, used)]
            found = np.linalg.solve(part + RIDGE * np.eye(len(used)), right[used])
            if (found[lower[used] == 0.0] < 0.0).any():
                continue
            found = found * _within(found / norm[used], lower[used], upper[used])
            drop = float(2 * found @ right[used] - found @ part @ found)
            if drop > best:
                best, theta = drop, np.zeros(len(norm))
                theta[used] = found / norm[used]
        if best > 0.0 and count == 0:
            break
    return best, theta


def _within(theta, lower, upper):
    """Factor that brings coefficients inside their bounds."""
    bound = np.where(theta > 0, upper, -lower)
    over = np.abs(theta) / np.maximum(bound, 1e-300)
    return 1.0 / max(over[np.isfinite(bound)].max(initial=0.0), 1.0)
