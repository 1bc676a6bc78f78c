"""Which few terms describe what is left: stepwise least squares, counted on parts left out.

Each step takes the group of columns that removes most of what those before leave (orthogonal
forward selection); then each group makes room for a better one, if there is one.  How many groups
are worth it, parts of the logs decide from which nothing was chosen and nothing fitted: the whole
choice is made again without each part.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

_DEPENDENT = 1e-4  # of its square, that the columns beside it must leave of a new one
_ROUNDS = 4  # of exchanges


@dataclasses.dataclass(frozen=True, eq=False)
class Choice:
    """Groups of columns that were chosen.

    Parameters
    ----------
    groups : list of int
        Their numbers.
    theta : ndarray
        Coefficients of the base, then of the columns of each group.

    """

    groups: list[int]
    theta: np.ndarray


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

    def gains(self, chosen: Sequence[int]) -> np.ndarray:
        """Drop of the sum of squares by each group beside some; none of those themselves."""
        at, diagonal = self.of(chosen), np.diag(self.gram)
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
        gains[list(chosen)] = -np.inf
        return gains

    def forward(self, most: int) -> list[list[int]]:
        """Best groups found of each count, from none to `most`, each from those of one less."""
        path: list[list[int]] = [[]]
        for _ in range(min(most, len(self.first))):
            path.append(self.exchanged([*path[-1], int(np.argmax(self.gains(path[-1])))]))
        return path

    def exchanged(self, chosen: list[int]) -> list[int]:
        """Groups after each has made room for a better one, until none is better."""
        for _ in range(_ROUNDS if len(chosen) > 1 else 0):
            before = chosen
            for place in range(len(chosen)):
                others = [*chosen[:place], *chosen[place + 1:]]
                chosen = [*others, int(np.argmax(self.gains(others)))]
            if set(chosen) == set(before):
                break
        return chosen


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
        Share of what all groups remove, on parts left out, that the last one has to remove.

    """
    scale = np.sqrt(np.diag(grams.sum(axis=0))) + 1e-300
    grams, rights = grams / np.outer(scale, scale), rights / scale
    ends = np.array([group[0] for group in groups]), np.array([group[-1] for group in groups])
    whole = Columns(grams.sum(axis=0), rights.sum(axis=0), *ends, base)
    drops = np.zeros(most + 1)
    for gram, right in zip(grams, rights):
        others = Columns(whole.gram - gram, whole.right - right, *ends, base)
        part = Columns(gram, right, *ends, base)
        drops += [part.removed(chosen, others.theta(chosen)) for chosen in others.forward(most)]
    count = _worth(drops - drops[0], least_gain)
    chosen = whole.forward(count)[-1]
    return Choice(chosen, whole.theta(chosen) / scale[whole.of(chosen)])


def _worth(gained: np.ndarray, least_gain: float) -> int:
    """Fewest groups that gain all but a small share of the most that is gained."""
    return int(np.flatnonzero(gained >= (1.0 - least_gain) * gained.max())[0])
