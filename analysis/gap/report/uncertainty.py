"""How sure the numbers of a correction are, all of them together."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.fitting.fit import Fit

SHARE_OF_SPREAD = 0.1  # of a standard deviation, in which the numbers change in proportion
Numbers = dict[str, float]
"""Numbers of a correction by key."""


def uncertainty(result: Result, numbers_of: Callable[[Result], Numbers]) -> dict[str, Any]:
    """Return the covariance of the numbers of a correction, from that of the fitted parameters.

    Parameters
    ----------
    result : Result
        A diagnosis.
    numbers_of : callable
        The numbers of the correction of a result, by key.

    Returns
    -------
    dict
        ``numbers``, the keys of those that the logs leave uncertain, and their ``covariance``,
        to first order.

    """
    fit, at = result.model, numbers_of(result)
    columns = []
    for place, spread in enumerate(fit.spread):
        step = SHARE_OF_SPREAD * spread
        if not (np.isfinite(step) and step > 0.0):
            columns.append(np.zeros(len(at)))
            continue
        moved = numbers_of(dataclasses.replace(result, model=_moved(fit, place, step)))
        columns.append(np.array([moved.get(key, at[key]) - at[key] for key in at]) / step)
    slopes = np.array(columns).reshape(len(columns), len(at)).T
    covariance = slopes @ _reported(fit) @ slopes.T
    uncertain = np.flatnonzero(np.diag(covariance) > 0.0)
    keys = list(at)
    return {"numbers": [keys[k] for k in uncertain],
            "covariance": covariance[np.ix_(uncertain, uncertain)]}


def _moved(fit: Fit, place: int, step: float) -> Fit:
    """Fit with one of its free parameters moved."""
    hypothesis = fit.hypothesis
    entry = hypothesis.free_parameters[place]
    value = hypothesis.values[entry.key].copy()
    value[entry.place()] += step
    return dataclasses.replace(fit, hypothesis=hypothesis.with_values(
        {**hypothesis.values, entry.key: value}))


def _reported(fit: Fit) -> np.ndarray:
    """Covariance with the reported standard deviations and the correlations of the fit."""
    spread = np.where(np.isfinite(fit.spread), fit.spread, 0.0)
    own = np.sqrt(np.clip(np.diag(fit.covariance), 0.0, None))
    scale = np.divide(spread, own, out=np.zeros_like(spread), where=own > 0.0)
    scaled = fit.covariance * np.outer(scale, scale)
    return np.where(np.isfinite(scaled), scaled, 0.0)
