"""Variance components of one parameter over units and over the logs of each unit.

    y_ul = mu + a_u + b_ul + e_ul,   a ~ N(0, tau^2),   b ~ N(0, omega^2),   e ~ N(0, s_ul^2)

mu is the model, a what differs by unit (wear, tolerance), b what differs by log (heat, day), and s
the standard deviation that each fit states.  tau and omega maximise the restricted likelihood;
intervals of few units and logs are those of Student's t.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

SURE = 0.05  # probability of a false alarm, in one fleet, and of a difference that is none
LEAST_UNITS = 3  # of which one can be odd
_START = 0.25  # of tau^2 and omega^2, in variances of the estimates

Estimates = tuple[np.ndarray, np.ndarray]
"""Values of the logs of one unit, and their standard deviations."""


@dataclasses.dataclass(frozen=True)
class UnitValue:
    """A parameter of one unit.

    Parameters
    ----------
    value, deviation : float
        Weighted mean over its logs, and the standard deviation of that.
    repeat : float
        Half width of the 95 % interval in which a new log of this unit gives the parameter.
    p : float
        Probability that a sound unit would be as far from the others; NaN with too few units.

    """

    value: float
    deviation: float
    repeat: float
    p: float


@dataclasses.dataclass(frozen=True)
class Variation:
    """How a parameter varies.

    Parameters
    ----------
    mean, half : float
        Common value, and half the width of its 95 % interval; NaN of a single unit.
    between_units, between_logs : float
        Standard deviations tau and omega.
    units_differ, logs_differ : bool
        Whether these are more than the intervals of the fits explain.
    units : tuple of UnitValue
        The units, in the order in which they were given.

    """

    mean: float
    half: float
    between_units: float
    between_logs: float
    units_differ: bool
    logs_differ: bool
    units: tuple[UnitValue, ...]


def variation(estimates: Sequence[Estimates]) -> Variation:
    """Variance components of a parameter.

    Parameters
    ----------
    estimates : sequence of (ndarray, ndarray)
        Values and standard deviations of the logs of each unit; one log or more of each.

    """
    from scipy.stats import chi2, norm, t

    tau, omega = components(estimates)
    value, variance = unit_means(estimates, omega)
    logs = sum(len(y) for y, _ in estimates) - len(estimates)
    q_logs = sum(float(np.sum(((y - _weighted(y, s**2)[0]) / s) ** 2)) for y, s in estimates)
    logs_differ = bool(logs and chi2.sf(q_logs, logs) < SURE)
    mean, of_mean = _weighted(value, tau**2 + variance)
    count = len(estimates)
    q_units = float(np.sum((value - _weighted(value, variance)[0]) ** 2 / variance))
    known = norm.ppf(1 - SURE / 2)  # of deviations that are known
    estimated = (t.ppf(1 - SURE / 2, logs) if omega else known) if logs else np.nan
    typical = np.array([float(np.sqrt(np.mean(s**2))) for _, s in estimates])
    half = float(t.ppf(1 - SURE / 2, count - 1) * np.sqrt(
        of_mean * _inflation(value, tau**2 + variance))) if count > 1 else np.nan
    units = tuple(UnitValue(float(y), float(np.sqrt(v)),
                            float(np.hypot(estimated * np.sqrt(omega**2 + v), known * s)),
                            _p_of_unit(estimates, k))
                  for k, (y, v, s) in enumerate(zip(value, variance, typical)))
    return Variation(float(mean), half, tau, omega,
                     bool(count > 1 and chi2.sf(q_units, count - 1) < SURE), logs_differ, units)


def odd_units(variations: Sequence[Variation]) -> list[list[int]]:
    """Units whose parameter is not that of the others, by parameter.

    In a fleet without an odd unit one is named with a probability of `SURE`, whatever the number
    of its units and parameters.
    """
    tests = sum(np.isfinite(unit.p) for one in variations for unit in one.units)
    return [[k for k, unit in enumerate(one.units) if unit.p < SURE / max(tests, 1)]
            for one in variations]


def components(estimates: Sequence[Estimates]) -> tuple[float, float]:
    """Standard deviations tau and omega of the largest restricted likelihood."""
    from scipy.optimize import minimize

    values = np.concatenate([y for y, _ in estimates])
    scale = float(np.std(values)) or float(np.mean([s.mean() for _, s in estimates])) or 1.0
    free = np.array([len(estimates) > 1, any(len(y) > 1 for y, _ in estimates)])
    scaled = [(y / scale, s / scale) for y, s in estimates]
    best = minimize(lambda x: -_restricted(scaled, *(x * free)), _START * free,
                    method="L-BFGS-B", bounds=[(0.0, None)] * 2).x
    tau, omega = scale * free * np.sqrt(best)
    return float(tau), float(omega)


def _restricted(estimates: Sequence[Estimates], of_units: float, of_logs: float) -> float:
    """Logarithm of the restricted likelihood, but for a constant, of tau^2 and omega^2."""
    total, means, variances = 0.0, [], []
    for y, s in estimates:
        d = of_logs + s**2
        mean, of_mean = _weighted(y, d)
        total -= 0.5 * float(np.sum(np.log(d)) + np.sum((y - mean) ** 2 / d)
                             + np.log1p(of_units / of_mean))
        means.append(mean)
        variances.append(of_units + of_mean)
    unit, v = np.array(means), np.array(variances)
    mean, of_mean = _weighted(unit, v)
    return total - 0.5 * float(np.sum((unit - mean) ** 2 / v) - np.log(of_mean))


def unit_means(estimates: Sequence[Estimates], omega: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean of each unit over its logs, and its variance."""
    pairs = [_weighted(y, omega**2 + s**2) for y, s in estimates]
    return np.array([mean for mean, _ in pairs]), np.array([variance for _, variance in pairs])


def _weighted(y: np.ndarray, variance: np.ndarray) -> tuple[float, float]:
    """Mean with the weights of least variance, and its variance."""
    weight = 1.0 / variance
    return float(np.sum(weight * y) / np.sum(weight)), float(1.0 / np.sum(weight))


def _inflation(y: np.ndarray, variance: np.ndarray) -> float:
    """Factor of Hartung and Knapp on the variance of a mean: what few estimates hide of tau."""
    mean, _ = _weighted(y, variance)
    return max(1.0, float(np.sum((y - mean) ** 2 / variance)) / (len(y) - 1))


def _p_of_unit(estimates: Sequence[Estimates], k: int) -> float:
    """Probability that a unit like the others is as far from them as unit k."""
    from scipy.stats import t

    others = [one for j, one in enumerate(estimates) if j != k]
    if len(estimates) < LEAST_UNITS:
        return float("nan")
    tau, omega = components(others)
    value, variance = unit_means(others, omega)
    mean, of_mean = _weighted(value, tau**2 + variance)
    own, of_own = unit_means([estimates[k]], omega)
    spread = (tau**2 + of_mean) * _inflation(value, tau**2 + variance) + of_own[0]
    return float(2 * t.sf(abs(own[0] - mean) / np.sqrt(spread), len(others) - 1))
