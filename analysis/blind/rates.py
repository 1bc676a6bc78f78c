"""Figures with their 95 % intervals: shares by Wilson, everything else by bootstrap."""

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
