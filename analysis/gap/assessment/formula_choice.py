"""Which few terms describe what is left: orthogonal forward selection, counted on left-out parts.

Each step takes the group of columns that removes most of what the ones before leave (orthogonal
least squares).  How many steps are worth it, parts of the logs decide from which nothing was
chosen and nothing fitted: the whole choice is made again without each part.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

_DEPENDENT = 1e-4  # of its square, that the chosen columns must leave of a new one


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """Groups that were chosen.

    Parameters
    ----------
    groups : list of int
        In the order of choice.
    theta : ndarray
        Coefficients of the base, then of the columns of each chosen group.

    """

    groups: list[int]
    theta: np.ndarray


def choose(grams: np.ndarray, rights: np.ndarray, groups: Sequence[tuple[int, ...]], base: int,
           most: int, least_gain: float) -> Choice:
    """Return the groups that predict parts which took no part in their choice.

    Parameters
    ----------
    grams, rights : ndarray, shapes (parts, c, c) and (parts, c)
        Normal equations of each part; the first `base` columns are always in.
    groups : sequence of tuple of int
        Columns of each group, one or two.
    base : int
        Columns that are always in.
    most : int
        Groups at most.
    least_gain : float
        Share of what is left, on parts left out, that one more group has to remove.

    """
    scale = np.sqrt(np.diag(grams.sum(axis=0))) + 1e-300
    grams, rights = grams / np.outer(scale, scale), rights / scale
    gram, right = grams.sum(axis=0), rights.sum(axis=0)
    drops = np.zeros(most + 1)
    for own_gram, own_right in zip(grams, rights):
        chosen = _forward(gram - own_gram, right - own_right, groups, base, most)
        for count in range(most + 1):
            columns = _columns(chosen[:count], groups, base)
            theta = _solve(gram - own_gram, right - own_right, columns)
            part = own_gram[np.ix_(columns, columns)]
            drops[count] += 2 * theta @ own_right[columns] - theta @ part @ theta
    count = _worth(drops, least_gain)
    chosen = _forward(gram, right, groups, base, count)
    columns = _columns(chosen, groups, base)
    return Choice(chosen, _solve(gram, right, columns) / scale[columns])


def _worth(drops: np.ndarray, least_gain: float) -> int:
    """Groups whose last one still removes a share of all that the groups together remove."""
    gained = drops.max() - drops[0]
    if gained <= 0.0:
        return 0
    return int(np.flatnonzero(drops >= drops.max() - least_gain * gained)[0])


def _forward(gram: np.ndarray, right: np.ndarray, groups: Sequence[tuple[int, ...]], base: int,
             count: int) -> list[int]:
    """Groups in the order in which each removes most of what those before leave."""
    whole = np.diag(gram).copy()
    gram, right = _without(gram, right, list(range(base)))
    first = np.array([group[0] for group in groups])
    last = np.array([group[-1] for group in groups])
    chosen: list[int] = []
    for _ in range(min(count, len(groups))):
        gains = _gains(gram, right, whole, first, last)
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        gram, right = _without(gram, right, list(groups[chosen[-1]]))
    return chosen


def _gains(gram: np.ndarray, right: np.ndarray, whole: np.ndarray, first: np.ndarray,
           last: np.ndarray) -> np.ndarray:
    """Drop of the sum of squares by each group of one or two columns."""
    a, b, c = gram[first, first], gram[first, last], gram[last, last]
    x, y = right[first], right[last]
    new = (a > _DEPENDENT * whole[first]) & (c > _DEPENDENT * whole[last])
    alone = np.where(new, x * x / np.where(new, a, 1.0), 0.0)
    determinant = a * c - b * b
    is_pair = (first != last) & (determinant > _DEPENDENT * a * c)
    both = (c * x * x - 2 * b * x * y + a * y * y) / np.where(is_pair, determinant, 1.0)
    return np.where(new & is_pair, both, alone)


def _without(gram: np.ndarray, right: np.ndarray, columns: list[int],
             ) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations of what some columns leave."""
    own = gram[:, columns]
    share = own @ np.linalg.pinv(gram[np.ix_(columns, columns)], hermitian=True)
    return gram - share @ own.T, right - share @ right[columns]


def _columns(chosen: Sequence[int], groups: Sequence[tuple[int, ...]], base: int) -> list[int]:
    return [*range(base), *(column for group in chosen for column in groups[group])]


def _solve(gram: np.ndarray, right: np.ndarray, columns: list[int]) -> np.ndarray:
    return np.linalg.pinv(gram[np.ix_(columns, columns)], hermitian=True) @ right[columns]
