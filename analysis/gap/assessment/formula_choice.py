"""Which term describes best what is left: orthogonal least squares, judged on parts left out.

The group of columns is taken that removes most of what the columns of all free parameters leave.
Parts of the logs say whether it is worth it: without each part the choice is made again, and its
columns predict that part.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

_DEPENDENT = 1e-3  # of its square, that the columns beside it must leave of a new one


@dataclasses.dataclass(frozen=True, eq=False)
class Columns:
    """Normal equations of columns in groups of one or two, beside a base that is always in.

    Parameters
    ----------
    gram, right : ndarray, shapes (c, c) and (c,)
        In units in which every column has about the same square.
    first, last : ndarray of int
        First and last column of each group; the same for a group of one.
    base : int
        Columns in front that are always in.

    """

    gram: np.ndarray
    right: np.ndarray
    first: np.ndarray
    last: np.ndarray
    base: int

    def of(self, chosen: Sequence[int]) -> list[int]:
        """Columns of the base and of some groups."""
        return [*range(self.base), *(column for group in chosen for column in sorted(
            {int(self.first[group]), int(self.last[group])}))]

    def theta(self, chosen: Sequence[int]) -> np.ndarray:
        """Coefficients of the base and of some groups."""
        at = self.of(chosen)
        return np.linalg.pinv(self.gram[np.ix_(at, at)], hermitian=True) @ self.right[at]

    def removed(self, chosen: Sequence[int], theta: np.ndarray) -> float:
        """Drop of the sum of squares by some groups with given coefficients."""
        at = self.of(chosen)
        return float(2 * theta @ self.right[at] - theta @ self.gram[np.ix_(at, at)] @ theta)

    def best(self) -> int:
        """The group that removes most of what the base leaves."""
        at, diagonal = list(range(self.base)), np.diag(self.gram)
        values, vectors = np.linalg.eigh(self.gram[np.ix_(at, at)])
        kept = values > 1e-10 * values.max(initial=0.0)
        rotated = (vectors[:, kept] / np.sqrt(values[kept])).T
        beside = rotated @ self.gram[at]
        right = self.right - (rotated @ self.right[at]) @ beside
        first, last = self.first, self.last
        a = diagonal[first] - (beside[:, first]**2).sum(axis=0)
        c = diagonal[last] - (beside[:, last]**2).sum(axis=0)
        b = self.gram[first, last] - (beside[:, first] * beside[:, last]).sum(axis=0)
        gains = _gains(a, b, c, right[first], right[last],
                       (a > _DEPENDENT * diagonal[first]) & (c > _DEPENDENT * diagonal[last]),
                       first != last)
        return int(np.argmax(gains))


def _gains(a: np.ndarray, b: np.ndarray, c: np.ndarray, x: np.ndarray, y: np.ndarray,
           is_new: np.ndarray, is_pair: np.ndarray) -> np.ndarray:
    """Drops by one or two columns of squares a and c, product b, right sides x and y."""
    determinant = a * c - b * b
    is_pair = is_pair & (determinant > _DEPENDENT * a * c)
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = x * x / a
        both = (c * x * x - 2 * b * x * y + a * y * y) / determinant
    return np.where(is_new, np.where(is_pair, both, alone), 0.0)


def choose(grams: np.ndarray, rights: np.ndarray, groups: Sequence[tuple[int, ...]], base: int,
           ) -> tuple[int, np.ndarray, float]:
    """Return the best group, its coefficients, and what it removes of parts left out.

    Parameters
    ----------
    grams, rights : ndarray, shapes (parts, c, c) and (parts, c)
        Normal equations of each part; the first `base` columns are always in.
    groups : sequence of tuple of int
        Columns of each group, one or two in a row.
    base : int
        Columns that are always in.

    """
    scale = np.sqrt(np.diag(grams.sum(axis=0)))
    scale[scale == 0.0] = 1.0  # of a torque that the logs do not show
    grams, rights = grams / np.outer(scale, scale), rights / scale
    ends = np.array([group[0] for group in groups]), np.array([group[-1] for group in groups])
    whole, gained = Columns(grams.sum(axis=0), rights.sum(axis=0), *ends, base), 0.0
    for gram, right in zip(grams, rights):
        part = Columns(gram, right, *ends, base)
        others = Columns(whole.gram - gram, whole.right - right, *ends, base)
        best, none = [others.best()], list[int]()
        gained += (part.removed(best, others.theta(best))
                   - part.removed(none, others.theta(none)))
    best = [whole.best()]
    own = whole.of(best)[base:]
    return best[0], whole.theta(best)[base:] / scale[own], gained
