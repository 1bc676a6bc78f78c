"""Two small optimisers: an order of least cost, and positions of least wire length."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike


def cheapest_order(cost: ArrayLike) -> list[int]:
    """Order items so that the sum of ``cost[a][b]`` over all a before b is small.

    Parameters
    ----------
    cost : array_like, shape (n, n)
        Cost of having the row's item before the column's.

    Returns
    -------
    list of int
        An order that no move of a single item improves, found from the order as given.

    """
    cost = np.asarray(cost, float)
    order = list(range(len(cost)))
    improved = True
    while improved:
        improved = False
        for item in range(len(cost)):
            k = order.index(item)
            others = order[:k] + order[k + 1:]
            before, after = cost[others, item], cost[item, others]
            # total[j]: item stands before others[j]
            total = np.concatenate([[0], np.cumsum(before)]) + np.concatenate(
                [np.cumsum(after[::-1])[::-1], [0]])
            best = int(np.argmin(total))
            if total[best] < total[k] - 1e-9:
                order, improved = [*others[:best], item, *others[best:]], True
    return order


def shortest(count: int, pulls: Sequence[tuple[int, int, float, float]],
             gaps: Sequence[tuple[int, int, float]]) -> np.ndarray:
    """Whole-numbered positions of least total wire length: a linear program.

    Parameters
    ----------
    count : int
        Number of things.
    pulls : list of (int, int, float, float)
        ``(a, b, d, weight)`` costs ``weight |x[b] - x[a] - d|``.
    gaps : list of (int, int, float)
        ``(a, b, d)`` keeps ``x[b] - x[a] >= d``.

    Returns
    -------
    ndarray of int, shape (count,)
        The positions, least zero.  Whole numbers solve it because every row has one 1 and one -1.

    """
    from scipy.optimize import linprog
    from scipy.sparse import coo_array

    if not pulls and not gaps:
        return np.zeros(count, int)
    rows = len(gaps) + 2 * len(pulls)
    entries: list[tuple[int, int, float]] = []
    bounds: list[float] = []
    for a, b, d in gaps:
        entries += [(len(bounds), a, 1.0), (len(bounds), b, -1.0)]
        bounds.append(-d)
    for k, (a, b, d, _) in enumerate(pulls):
        for sign in (1.0, -1.0):  # sign (x[b] - x[a] - d) <= slack
            row = len(bounds)
            entries += [(row, b, sign), (row, a, -sign), (row, count + k, -1.0)]
            bounds.append(sign * d)
    i, j, values = zip(*entries)
    matrix = coo_array((values, (i, j)), shape=(rows, count + len(pulls))).tocsr()
    price = np.concatenate([np.zeros(count), [weight for *_, weight in pulls]])
    limits = [(0, None)] * (count + len(pulls))
    found = linprog(price, A_ub=matrix, b_ub=bounds, bounds=limits, method="highs-ds")
    x = np.rint(found.x[:count]).astype(int)
    return x - x.min()
