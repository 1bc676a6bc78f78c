"""What each of several causes takes of the gap: alone, last, and on average over all orders."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Mapping, Sequence

from clie_blocks.analysis.gap.assessment.result import Result


@dataclasses.dataclass(frozen=True)
class Share:
    """Shares of the excess of the refitted nominal model, from 0 to 1.

    Parameters
    ----------
    alone : float
        What the cause takes as the only one.
    last : float
        What it takes where all others are in the model: what is lost without it.
    mean : float
        What it takes on average over the orders in which the causes can be added (Shapley's
        value); these add up to what all of them take together.

    """

    alone: float
    last: float
    mean: float


def shares_of(result: Result, names: Sequence[str]) -> dict[str, Share]:
    """Share of each of some causes, from the hypotheses that were fitted."""
    left = {frozenset[str](): result.evidence.nominal_excess}
    for row in result.evidence.rows:
        own = frozenset(row.names)
        left[own] = min(row.excess, left.get(own, math.inf))
    return cause_shares(names, left)


def cause_shares(names: Sequence[str], left: Mapping[frozenset[str], float],
                 ) -> dict[str, Share]:
    """Share of each of some causes.

    Parameters
    ----------
    names : sequence of str
        The causes.
    left : mapping
        Excess by the set of causes in the model, with the empty set for the nominal one.  A set
        that was not fitted takes as much as the best of its parts.

    """
    causes, whole = sorted(set(names)), max(left[frozenset()], 1e-9)
    taken = {frozenset(some): _taken(frozenset(some), left, whole)
             for count in range(len(causes) + 1)
             for some in itertools.combinations(causes, count)}
    return {name: _share(name, causes, taken) for name in causes}


def _taken(some: frozenset[str], left: Mapping[frozenset[str], float], whole: float) -> float:
    least = min(excess for own, excess in left.items() if own <= some)
    return min(max(1.0 - max(least, 0.0) / whole, 0.0), 1.0)


def _share(name: str, causes: Collection[str], taken: Mapping[frozenset[str], float]) -> Share:
    everything, n = frozenset(causes), len(causes)
    mean = 0.0
    for before in taken:
        if name not in before:
            orders = math.factorial(len(before)) * math.factorial(n - len(before) - 1)
            mean += orders * (taken[before | {name}] - taken[before])
    return Share(taken[frozenset({name})], taken[everything] - taken[everything - {name}],
                 mean / math.factorial(n))
