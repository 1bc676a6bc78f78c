"""Intervals and scores of everything that is counted: trials, decisions, stated probabilities.

The module is not called ``statistics``, which would shadow the one of the standard library.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

Row = TypeVar("Row")
NORMAL_95 = 1.96  # half width of a two-sided 95 % interval, in standard deviations
DRAWS = 400  # resamples of a bootstrap
BINS = 10  # of the stated probability, for the calibration error


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share, which holds for few trials and for shares near 0 and 1.

    Parameters
    ----------
    hits, count : int
        Successes and trials; at least one trial.

    Returns
    -------
    tuple of float
        Lower and upper end, between 0 and 1.

    """
    from scipy.stats import binomtest

    interval = binomtest(hits, count).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def bonett_price(pairs: Sequence[tuple[bool, bool]]) -> tuple[float, float]:
    """95 % interval of the difference of two shares on the same trials, by Bonett and Price.

    Half a trial is added to each of the two counts of disagreement, which keeps the interval
    valid where there is next to nothing to count (J. Educational and Behavioral Statistics 37,
    2012).

    Parameters
    ----------
    pairs : sequence of (bool, bool)
        Whether the first and the second method succeeded, trial by trial; at least one trial.

    Returns
    -------
    tuple of float
        Lower and upper end of "first minus second", between -1 and 1.

    """
    from scipy.special import ndtri

    total = len(pairs) + 2
    only_first = (sum(a and not b for a, b in pairs) + 1) / total
    only_second = (sum(b and not a for a, b in pairs) + 1) / total
    middle = only_first - only_second
    half = float(ndtri(0.975)) * np.sqrt((only_first + only_second - middle**2) / total)
    return float(max(-1.0, middle - half)), float(min(1.0, middle + half))


def bootstrap(rows: Sequence[Row], statistic: Callable[[list[Row]], float],
              draws: int = DRAWS) -> tuple[float, float]:
    """95 % percentile interval of a statistic, from rows drawn with replacement, always alike.

    Parameters
    ----------
    rows : sequence
        What was observed, one entry per trial; at least one.
    statistic : callable
        ``statistic(rows)`` is a number.
    draws : int
        Number of resamples.

    Returns
    -------
    tuple of float
        Lower and upper end; equal where there is a single row.

    """
    from scipy import stats

    if len(rows) == 1:  # which scipy refuses
        return (float(statistic(list(rows))),) * 2
    interval = stats.bootstrap(
        (np.arange(len(rows)),), lambda drawn: float(statistic([rows[i] for i in drawn])),
        n_resamples=draws, vectorized=False, method="percentile",
        random_state=np.random.default_rng(0)).confidence_interval
    return float(interval.low), float(interval.high)


def brier(points: Sequence[tuple[float, bool]]) -> float:
    """Brier score: mean squared difference of stated probability and outcome.

    Parameters
    ----------
    points : sequence of (float, bool)
        Stated probability, and whether it happened.

    """
    stated, happened = np.array(points, float).T
    return float(np.mean((stated - happened) ** 2))


def calibration_error(points: Sequence[tuple[float, bool]], bins: int = BINS) -> float:
    """Expected calibration error: mean distance of stated from observed shares over bins.

    Parameters
    ----------
    points : sequence of (float, bool)
        Stated probability, and whether it happened.
    bins : int
        Equal bins of the stated probability.

    """
    stated, happened = np.array(points, float).T
    place = np.minimum((stated * bins).astype(int), bins - 1)
    return float(np.abs(np.bincount(place, stated - happened, bins)).sum() / len(points))
