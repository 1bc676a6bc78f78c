"""Figures with their 95 % intervals, in the form in which a scoreboard holds them.

Shares have Wilson's interval, differences of shares on the same trials that of Bonett and Price;
all else is resampled by bootstrap over the trials.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.statistical_measures import bonett_price, bootstrap, wilson


def rate(flags: Iterable[bool]) -> dict[str, Any]:
    """Hits, count, share and Wilson 95 % interval; share None where there is nothing."""
    flags = [bool(flag) for flag in flags]
    hits, count = sum(flags), len(flags)
    if not count:
        return {"rate": None, "hits": 0, "of": 0, "interval": None}
    return {"rate": hits / count, "hits": hits, "of": count, "interval": [*wilson(hits, count)]}


def share_text(figure: dict[str, Any]) -> str:
    """A share of `rate` for a terminal: '7 of 8 (0.53 to 0.98)'."""
    if figure["interval"] is None:
        return "none"
    low, high = figure["interval"]
    return f"{figure['hits']} of {figure['of']} ({low:.2f} to {high:.2f})"


def share_difference(pairs: Sequence[tuple[bool, bool]]) -> dict[str, Any]:
    """Difference of two shares on the same trials with its 95 % interval, by Bonett and Price.

    Parameters
    ----------
    pairs : sequence of (bool, bool)
        Whether the first and the second are right, by trial.

    """
    count = len(pairs)
    if not count:
        return {"value": None, "of": 0, "interval": None}
    first, second = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
    return {"value": (first - second) / count, "of": count,
            "interval": [*bonett_price(pairs)]}


def estimate(rows: Iterable[Any], statistic: Callable[[list[Any]], float]) -> dict[str, Any]:
    """Return a statistic of some rows, one per trial, with its bootstrap interval."""
    rows = list(rows)
    if not rows:
        return {"value": None, "of": 0, "interval": None}
    return {"value": float(statistic(rows)), "of": len(rows),
            "interval": [*bootstrap(rows, statistic)]}


def summary(values: Iterable[float | None]) -> dict[str, Any]:
    """Median with its interval, mean and largest of some values; None is left out."""
    known = [float(value) for value in values if value is not None]
    middle = estimate(known, np.median)
    return {"of": len(known), "median": middle["value"], "interval": middle["interval"],
            "mean": float(np.mean(known)) if known else None,
            "largest": max(known, default=None)}
