"""Where the gap lies: its shares by joint, time, frequency, region of operation and block.

All but those of the blocks are shares of the squared prediction error of the refitted nominal
model, over all logs, less what sensor noise alone is expected to leave there: in a joint, a part
of the time, a band of frequency (where that noise has the colour of the loop) or a quarter of the
operating range.  What lies below the noise counts as zero, so shares are never negative; they sum
to one, or are all zero where nothing exceeds the noise.  Over time each joint counts in units of
its own noise.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.cause_shares import shares_of
from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.residual.noise import Noise
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.posterior import (
    NONE,
    PARAMETRIC,
    RankedCause,
    marginals,
)
from clie_blocks.linear_filters import frequency_response, lfilter

BANDS = ((0.0, 0.3), (0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 50.0))  # Hz
PARTS = 10  # of the time of each log
_TINY = 1e-300


def localise(residuals: ResidualModel, nominal: Fit, check: ControllerCheck) -> dict[str, Any]:
    """Return the map of the gap in plain types."""
    problem, model = residuals.problem, nominal.hypothesis
    errors = [residuals.rows(j).of_samples(model.error(j)) for j in range(len(problem.logs))]
    row_times = [residuals.rows(j).ticks * problem.period for j in range(len(problem.logs))]
    floor = np.array([_floor(noise) for noise in residuals.noises])
    power = np.mean([np.mean(e**2, axis=0) for e in errors], axis=0)
    share = _shares(power, floor**2)
    return {
        "joint": [{"joint": k + 1, "name": problem.joints[k], "share": share[k],
                   "rms": np.sqrt(power[k]), "floor": floor[k], "unit": "rad",
                   "chi2_per_sample": nominal.chi2[:, k].sum() / nominal.samples[:, k].sum(),
                   "replay_error": check.replay_error[k], "replay_limit": check.limit[k]}
                  for k in range(problem.n)],
        "time": _by_time(errors, row_times, floor),
        "frequency": _by_frequency(errors, row_times, residuals.noises),
        "region": _by_region(residuals, errors, row_times, floor),
    }


def _floor(noise: Noise) -> float:
    """RMS of the decimated error that sensor noise alone leaves."""
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    shape = lfilter([1.0], noise.whitener, impulse)
    return float(np.sqrt(shape @ shape))


def _shares(power: Sequence[float] | np.ndarray, floor: float | np.ndarray) -> list[float]:
    """Shares of what exceeds the noise: never negative, with sum one, or all zero."""
    beyond = np.maximum(np.asarray(power) - floor, 0.0)
    return (beyond / (beyond.sum() + _TINY)).tolist()


def _by_time(errors: Sequence[np.ndarray], row_times: Sequence[float], floor: np.ndarray,
             ) -> list[dict[str, Any]]:
    rows = []
    for j, error in enumerate(errors):
        parts = np.array_split(np.sum(error**2 / floor**2, axis=1), PARTS)
        power = [part.mean() for part in parts]
        rows.append({"log": j + 1, "seconds_per_part": len(error) * row_times[j] / PARTS,
                     "share": _shares(power, error.shape[1])})
    return rows


def _by_frequency(errors: Sequence[np.ndarray], row_times: Sequence[float],
                  noises: Sequence[Noise]) -> list[dict[str, Any]]:
    power, floor = np.zeros(len(BANDS)), np.zeros(len(BANDS))
    for error, row_time in zip(errors, row_times):
        frequency = np.fft.rfftfreq(len(error), row_time)
        spectrum = np.sum(np.abs(np.fft.rfft(error, axis=0)) ** 2, axis=1) / len(error) ** 2
        noise = np.sum([_noise_spectrum(one, frequency * row_time) for one in noises],
                       axis=0) / len(error)
        for i, (low, high) in enumerate(BANDS):
            inside = (frequency >= low) & (frequency < high)
            power[i] += spectrum[inside].sum()
            floor[i] += noise[inside].sum()
    return [{"band_hz": list(band), "share": share}
            for band, share in zip(BANDS, _shares(power, floor))]


def _noise_spectrum(noise: Noise, cycles_per_row: np.ndarray) -> np.ndarray:
    """Spectrum of the decimated error that sensor noise alone leaves; its mean is the power."""
    omega = 2 * np.pi * cycles_per_row
    return np.abs(frequency_response([1.0], noise.whitener, omega)) ** 2


def _by_region(residuals: ResidualModel, errors: Sequence[np.ndarray],
               row_times: Sequence[float], floor: np.ndarray) -> list[dict[str, Any]]:
    """Share of each quarter of position, velocity, speed and torque, per joint."""
    rows, logs = [], residuals.problem.logs
    for k in range(residuals.problem.n):
        e = np.concatenate([error[:, k] for error in errors]) ** 2
        positions = [residuals.rows(j).of_samples(log.q[:, k]) for j, log in enumerate(logs)]
        q = np.concatenate(positions)
        u = np.concatenate([residuals.rows(j).of_samples(log.u[:, k])
                            for j, log in enumerate(logs)])
        dq = np.concatenate([np.gradient(q_of_log, row_time)
                             for q_of_log, row_time in zip(positions, row_times)])
        quarters = {name: _quarters(x, e, floor[k]**2) for name, x in (
            ("position", q), ("velocity", dq), ("speed", np.abs(dq)), ("torque", u))}
        rows.append({"joint": k + 1, **quarters})
    return rows


def _quarters(x: np.ndarray, e: np.ndarray, floor: float) -> dict[str, list[float]]:
    """Share of the squared error e in each quarter of the samples, ordered by x."""
    edges = np.quantile(x, [0.25, 0.5, 0.75])
    parts = [e[np.digitize(x, edges) == i] for i in range(4)]
    floors = np.array([floor * len(part) for part in parts])
    return {"edges": edges.tolist(), "share": _shares([part.sum() for part in parts], floors)}


OF_PORT = {"drive": "drive", "load": "joint", "friction": "joint", "body": "links",
           "transmission": "gear", "sensor": "encoder"}
NEGLIGIBLE = 1e-4  # probability of a hypothesis whose causes count for no block
BLOCKS = ("controller", "drive", "gear", "joint", "links", "encoder")


def block_shares(result: Result) -> list[dict[str, Any]]:
    """Share of the gap that each block of the loop is expected to cause.

    Each hypothesis gives the share of chi^2 beyond the noise that it removes to the blocks where
    its causes act, each its own (`cause_shares`), weighted with its probability; what no
    hypothesis removes has no block.
    Parameter errors are attributed to the joint, and where there is no gap nothing is shared out.
    Set-points are delayed before the controller has them.

    Returns
    -------
    list of dict
        ``block`` and ``share``, largest first; ``unassigned`` last.

    """
    probability = marginals(result.ranking)
    shares = _of_hypotheses(result)
    shares["joint"] += sum(ranked.probability for ranked in result.ranking
                           if ranked.names == (PARAMETRIC,) and not _members(ranked))
    for finding in result.findings:
        shares = _with_certain(shares, "controller", finding.share)
    if result.controller.misdescribed or result.controller.coarse:
        block = "controller" if result.controller.misdescribed else "encoder"
        shares = _with_certain(shares, block, result.method.verdict.certain)
    rest = 1.0 - probability.get(NONE, 0.0) - sum(shares.values())
    largest_first = sorted(shares.items(), key=lambda item: -item[1])
    return [*({"block": block, "share": float(share)} for block, share in largest_first),
            {"block": "unassigned", "share": max(0.0, rest)}]


def _members(ranked: RankedCause) -> tuple[Member, ...]:
    return ranked.fit.hypothesis.members if ranked.fit is not None else ()


def _of_hypotheses(result: Result) -> dict[str, float]:
    """Share of each block by what the hypotheses of the ranking remove."""
    shares = dict.fromkeys(BLOCKS, 0.0)
    for ranked in result.ranking:
        members = _members(ranked)
        if ranked.fit is None or not members or ranked.probability < NEGLIGIBLE:
            continue
        of_cause = shares_of(ranked.fit, result.nominal, result.residuals)
        count = Counter(member.cause.name for member in members)
        for member in members:
            name = member.cause.name
            block = ("joint" if is_number(member.cause)
                     else OF_PORT[member.cause.pieces[0].port])
            taken = max(of_cause[name].mean, 0.0)
            shares[block] += ranked.probability * taken / count[name]
    return shares


def _with_certain(shares: dict[str, float], block: str, certain: float) -> dict[str, float]:
    """Shares after one block is known to cause a part of the gap."""
    shares = {name: (1.0 - certain) * share for name, share in shares.items()}
    shares[block] += certain
    return shares
