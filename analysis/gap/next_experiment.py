"""The run that best tells the remaining causes apart."""

import itertools

import numpy as np

from clie_blocks.analysis.gap.problem import Log
from clie_blocks.analysis.gap.verdict import NONE, UNKNOWN

DURATION = 20.0  # s
STRONG = 25.0  # chi^2 between two models that decides


def next_experiment(bench, base, ranking, calibration):
    """Return the experiment that separates the causes of the 90 % set, or None if one is left.

    Every experiment of a short menu is simulated with each remaining model; the whitened distance
    between two predictions is the evidence that the run would bring.

    Parameters
    ----------
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.
    ranking : list of Standing
        Hypotheses, most probable first.
    calibration : Calibration
        Numbers of the verdict.

    """
    rivals = _rivals(ranking)
    if len(rivals) < 2:
        return None
    table = []
    for name, log in menu(bench.problem):
        distances = [_distance(bench, log, one.fit, two.fit)
                     for one, two in itertools.combinations(rivals, 2)]
        table.append({"experiment": name, "least_distance": min(distances),
                      "expected_set_size": _expected_size(rivals, distances)})
    best = min(table, key=lambda row: (row["expected_set_size"], -row["least_distance"]))
    return {"separates": [list(standing.names) for standing in rivals], "best": best,
            "menu": table}


def _rivals(ranking):
    rivals, reached = [], 0.0
    for standing in ranking:
        if reached >= 0.9 or len(rivals) == 4:
            break
        reached += standing.probability
        if standing.fit is not None and standing.names not in ((NONE,), (UNKNOWN,)):
            rivals.append(standing)
    return rivals


def menu(problem):
    """Named experiments within the ranges of speed, travel and torque that the logs have shown."""
    first = problem.fit[0]
    time = problem.period * np.arange(round(DURATION / problem.period))[:, None]
    centre = np.mean([log.q.mean(axis=0) for log in problem.logs], axis=0)
    travel = np.max([np.ptp(log.q, axis=0) for log in problem.logs], axis=0) / 2
    torque = np.max([np.quantile(np.abs(log.u), 0.95, axis=0) for log in problem.logs], axis=0)
    still, zero = centre + 0 * time, 0 * centre + 0 * time
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / 10.0))
    sweep = np.sin(2 * np.pi * (0.1 * time + (8.0 - 0.1) * time**2 / (2 * DURATION)))
    tones = sum(np.sin(2 * np.pi * f * time + f**2) for f in (0.1, 0.3, 0.7, 1.3, 2.9, 5.3, 9.1))
    ladder = np.sin(2 * np.pi * 0.25 * time) * np.floor(1 + 4 * time / DURATION) / 4
    runs = (
        ("slow triangle over the full travel", centre + travel * triangle, zero),
        ("wide slow triangle, 2.5 times the travel", centre + 2.5 * travel * triangle, zero),
        ("chirp of torque, 0.1 to 8 Hz", still, 0.7 * torque * sweep),
        ("multisine of torque, 0.1 to 9 Hz", still, 0.3 * torque * tones),
        ("ladder of amplitudes", centre + travel * ladder, zero))
    return [(name, Log(name, q_d, zero, q_d, pe, centre, first.at_rest, zero))
            for name, q_d, pe in runs]


def _distance(bench, log, one, two):
    """Whitened squared distance between two models' motions in an experiment."""
    from clie_blocks.analysis.gap.noise import decimated, white

    runs = [fit.hypothesis.simulator.run(log, fit.hypothesis.of_log(0))[0] for fit in (one, two)]
    change = decimated(runs[0] - runs[1], bench.problem.period)
    return float(sum(np.sum(white(change[:, k], bench.noises[k].whitener) ** 2)
                     for k in range(bench.problem.n)))


def _expected_size(rivals, distances):
    """Expected size of the set: a pair stays together with the odds of its distance."""
    weights = np.array([standing.probability for standing in rivals])
    weights = weights / weights.sum()
    size = np.ones(len(rivals))
    for (i, j), distance in zip(itertools.combinations(range(len(rivals)), 2), distances):
        together = np.exp(-min(distance / STRONG, 50.0))
        size[i] += together
        size[j] += together
    return float(weights @ size)
