"""Ridge regression whose penalty is chosen by what it predicts of parts that are left out."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class RidgeFit:
    """A ridge regression on parts of some data, with the best of some penalties.

    Parameters
    ----------
    theta : ndarray, shape (c,)
        Coefficients that are fitted to all parts.
    left_out : ndarray, shape (parts, c)
        Coefficients that are fitted without each part.
    drops : ndarray, shape (parts,)
        What those remove of the sum of squares of the part that they were not fitted to; negative
        where they add to it.

    """

    theta: np.ndarray
    left_out: np.ndarray
    drops: np.ndarray


def ridge_cv(grams: np.ndarray, rights: np.ndarray, penalties: Sequence[float],
             score: Callable[[np.ndarray], float] = np.sum) -> RidgeFit:
    """Return the ridge regression whose drops on parts left out have the best score.

    `grams` (parts, c, c) and `rights` (parts, c) are the normal equations of each part; a penalty
    is in units of the diagonal of `grams`.
    """
    fits = [_ridge_fit(grams, rights, penalty) for penalty in penalties]
    return fits[int(np.argmax([score(fit.drops) for fit in fits]))]


def _ridge_fit(grams: np.ndarray, rights: np.ndarray, penalty: float) -> RidgeFit:
    gram, right = grams.sum(axis=0), rights.sum(axis=0)
    ridge = penalty * np.eye(len(right))
    left_out = np.array([np.linalg.solve(gram - own_gram + ridge, right - own_right)
                         for own_gram, own_right in zip(grams, rights)])
    drops = np.array([2 * theta @ own_right - theta @ own_gram @ theta
                      for theta, own_gram, own_right in zip(left_out, grams, rights)])
    return RidgeFit(np.linalg.solve(gram + ridge, right), left_out, drops)
