"""Figures with their 95 % intervals.

Shares have Wilson's, differences of shares on the same trials those of Bonett and Price, all else
is drawn anew by bootstrap.
"""

import math

import numpy as np

DRAWS = 400


def rate(flags):
    """Hits, count, share and Wilson 95 % interval; share None where there is nothing."""
    flags = [bool(flag) for flag in flags]
    hits, count = sum(flags), len(flags)
    if not count:
        return {"rate": None, "hits": 0, "of": 0, "interval": None}
    z, p = 1.959964, hits / count
    scale = 1 + z * z / count
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / scale
    middle = (p + z * z / (2 * count)) / scale
    return {"rate": p, "hits": hits, "of": count,
            "interval": [max(0.0, middle - half), min(1.0, middle + half)]}


def difference(pairs):
    """Difference of two shares on the same trials with its 95 % interval, by Bonett and Price.

    Half a trial more on either side where the two differ keeps the interval honest where there is
    next to nothing to count (J. Educational and Behavioral Statistics 37, 2012).

    Parameters
    ----------
    pairs : sequence of (bool, bool)
        Whether the first and the second hit, by trial.

    """
    count = len(pairs)
    if not count:
        return {"value": None, "of": 0, "interval": None}
    first, second = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
    up, down = (first + 1) / (count + 2), (second + 1) / (count + 2)
    half = 1.959964 * math.sqrt((up + down - (up - down) ** 2) / (count + 2))
    return {"value": (first - second) / count, "of": count,
            "interval": [max(-1.0, up - down - half), min(1.0, up - down + half)]}


def figure(rows, statistic):
    """Return a statistic of some rows with its interval, drawn anew from the rows themselves.

    Parameters
    ----------
    rows : sequence
        What was observed, one entry per trial.
    statistic : callable
        ``statistic(rows)`` is a number.

    """
    rows = list(rows)
    if not rows:
        return {"value": None, "of": 0, "interval": None}
    picks = np.random.default_rng(0).integers(0, len(rows), (DRAWS, len(rows)))
    drawn = [statistic([rows[i] for i in pick]) for pick in picks]
    return {"value": float(statistic(rows)), "of": len(rows),
            "interval": np.quantile(drawn, [0.025, 0.975]).tolist()}


def spread(values):
    """Median with its interval, mean and largest of some values; None is left out."""
    values = [float(value) for value in values if value is not None]
    middle = figure(values, np.median)
    return {"of": len(values), "median": middle["value"], "interval": middle["interval"],
            "mean": float(np.mean(values)) if values else None,
            "largest": max(values, default=None)}
