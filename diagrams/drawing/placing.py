"""Two small optimisers: an order of least cost, and positions of least wire length."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

EXACT = 10  # items, up to which every order is compared
WORTH = 0.01  # cost that another order must save; listed orders differ by less


def cheapest_order(cost: ArrayLike) -> list[int]:
    """Order items so that the sum of ``cost[a][b]`` over all a before b is small.

    Parameters
    ----------
    cost : array_like, shape (n, n)
        Cost of having the row's item before the column's.

    Returns
    -------
    list of int
        The cheapest order of few items; of more than `EXACT` an order that no move of a single
        item improves, found from the order as given, which also decides between equals.

    """
    cost = np.asarray(cost, float)
    order = _without_better_moves(cost)
    if len(cost) > EXACT:
        return order
    best = _cheapest(cost)
    return best if _total(cost, best) < _total(cost, order) - WORTH else order


def _total(cost: np.ndarray, order: Sequence[int]) -> float:
    return float(np.triu(cost[np.ix_(order, order)], 1).sum())


def _cheapest(cost: np.ndarray) -> list[int]:
    """Cheapest order by dynamic programming over the sets of items that stand first."""
    n, price = len(cost), cost.tolist()
    least, last = [0.0] * 2**n, [-1] * 2**n
    for chosen in range(1, 2**n):
        inside = [k for k in range(n) if chosen >> k & 1]
        totals = [least[chosen ^ 1 << k] + sum(price[a][k] for a in inside if a != k)
                  for k in inside]
        best = int(np.argmin(totals))
        least[chosen], last[chosen] = totals[best], inside[best]
    order, chosen = [], 2**n - 1
    while chosen:
        order.append(last[chosen])
        chosen ^= 1 << last[chosen]
    return order[::-1]


def _without_better_moves(cost: np.ndarray) -> list[int]:
    """Order that no move of a single item improves, found from the order as given."""
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
