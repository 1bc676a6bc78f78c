"""Where the gap lies: its shares by joint, signal, time, frequency, region of operation and block.

Shares are of the squared error beyond the noise floor, of the refitted nominal model, over all
logs.  The equation error w = (e inverse-filtered by S) is read as the torque that the model lacks.
"""

import numpy as np

from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.residual.noise import RATE, decimated
from clie_blocks.analysis.gap.verdict.posterior import NONE, PARAMETRIC, marginals
from clie_blocks.analysis.gap.verdict.signal_findings import CERTAIN
from clie_blocks.linear_filters import lfilter

BANDS = ((0.0, 0.3), (0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 50.0))  # Hz
PARTS = 10  # of the time of each log


def localise(bench, base, check):
    """Return the map of the gap as plain numbers.

    Parameters
    ----------
    bench : Bench
        Noise.
    base : Fit
        The refitted nominal model.
    check : ControllerCheck
        Replay of the controller.

    """
    problem = bench.problem
    at = base.hypothesis
    errors = [decimated(at.error(j), problem.period) for j in range(len(problem.logs))]
    floor = np.array([_floor(noise) for noise in bench.noises])
    power = np.mean([np.mean(e**2, axis=0) for e in errors], axis=0)
    beyond = np.maximum(power - floor**2, 0.0)
    total = beyond.sum() + 1e-300
    return {
        "joint": [{"joint": k + 1, "name": problem.joints[k], "share": beyond[k] / total,
                   "rms": np.sqrt(power[k]), "floor": floor[k], "unit": "rad",
                   "chi2_per_sample": base.chi2[:, k].sum() / base.samples[:, k].sum(),
                   "replay_error": check.replay_error[k], "replay_limit": check.limit[k]}
                  for k in range(problem.n)],
        "time": _by_time(errors, floor),
        "frequency": _by_frequency(errors, floor),
        "region": _by_region(problem, errors),
    }


def _floor(noise):
    """RMS of the decimated error that sensor noise alone leaves."""
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    shape = lfilter([1.0], noise.whitener, impulse)
    return float(np.sqrt(shape @ shape))


def _shares(values, floor):
    beyond = np.maximum(np.array(values) - floor, 0.0)
    return (beyond / (beyond.sum() + 1e-300)).tolist()


def _by_time(errors, floor):
    found = []
    for j, error in enumerate(errors):
        parts = np.array_split(np.sum(error**2 / floor**2, axis=1), PARTS)
        power = [part.mean() for part in parts]
        found.append({"log": j + 1, "seconds_per_part": len(error) / RATE / PARTS,
                      "share": _shares(power, error.shape[1])})
    return found


def _by_frequency(errors, floor):
    spectrum, noise_line = {}, {}
    for error in errors:
        grid = np.fft.rfftfreq(len(error), 1.0 / RATE)
        power = np.sum(np.abs(np.fft.rfft(error, axis=0)) ** 2, axis=1) / len(error) ** 2
        for band in BANDS:
            inside = (grid >= band[0]) & (grid < band[1])
            spectrum[band] = spectrum.get(band, 0.0) + power[inside].sum()
            noise_line[band] = noise_line.get(band, 0.0) + inside.sum() / len(error) * (
                np.sum(floor**2) / 1.0)
    total = sum(spectrum.values()) + 1e-300
    return [{"band_hz": list(band), "share": spectrum[band] / total} for band in BANDS]


def _by_region(problem, errors):
    """Share of each quarter of position, speed and torque, per joint, against an even spread."""
    found = []
    for k in range(problem.n):
        e = np.concatenate([error[:, k] for error in errors]) ** 2
        q = np.concatenate([decimated(log.q[:, k], problem.period) for log in problem.logs])
        u = np.concatenate([decimated(log.u[:, k], problem.period) for log in problem.logs])
        dq = np.concatenate([np.gradient(decimated(log.q[:, k], problem.period), 1.0 / RATE)
                             for log in problem.logs])
        rows = {name: _quarters(x, e) for name, x in (
            ("position", q), ("velocity", dq), ("speed", np.abs(dq)), ("torque", u))}
        found.append({"joint": k + 1, **rows})
    return found


def _quarters(x, e):
    """Share of the squared error in each quarter of the samples, ordered by x."""
    edges = np.quantile(x, [0.25, 0.5, 0.75])
    part = np.digitize(x, edges)
    return {"edges": edges.tolist(),
            "share": [float(e[part == i].sum() / (e.sum() + 1e-300)) for i in range(4)]}


OF_PORT = {"drive": "drive", "load": "joint", "friction": "joint", "body": "links",
           "transmission": "gear", "sensor": "encoder"}
BLOCKS = ("controller", "drive", "gear", "joint", "links", "encoder")


def block_shares(diagnosis):
    """Share of the gap that each block of the loop is expected to cause.

    Each hypothesis gives the share of chi^2 beyond the noise that it removes to the blocks where
    its causes act, weighted with its probability; what no hypothesis removes has no block.  Wrong
    numbers are the joint's, and where there is no gap nothing is shared out.  Goals are late
    before the controller has them.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.

    Returns
    -------
    list of dict
        ``block`` and ``share``, largest first; ``unassigned`` last.

    """
    shares = dict.fromkeys(BLOCKS, 0.0)
    whole = max(excess(diagnosis.base), 1e-9)
    told = marginals(diagnosis.ranking)
    shares["joint"], sound = told.get(PARAMETRIC, 0.0), told.get(NONE, 0.0)
    for standing in diagnosis.ranking:
        members = standing.fit.hypothesis.members if standing.fit is not None else ()
        removed = np.clip(1.0 - max(standing.excess, 0.0) / whole, 0.0, 1.0)
        for member in members:
            block = OF_PORT[member.cause.pieces[0].port]
            shares[block] += standing.probability * removed / len(members)
    for cause in diagnosis.paths:
        shares = {block: (1.0 - cause.share) * share for block, share in shares.items()}
        shares["controller"] += cause.share
    if diagnosis.check.misdescribed or diagnosis.check.coarse:
        guilty = "controller" if diagnosis.check.misdescribed else "encoder"
        shares = {block: (1.0 - CERTAIN) * share for block, share in shares.items()}
        shares[guilty] += CERTAIN
    left = {"block": "unassigned", "share": max(0.0, 1.0 - sound - sum(shares.values()))}
    rows = [{"block": block, "share": float(share)} for block, share in shares.items()]
    return [*sorted(rows, key=lambda row: -row["share"]), left]
