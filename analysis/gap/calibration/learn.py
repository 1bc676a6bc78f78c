"""Learn the numbers of the verdict on robots whose truth is known.

Simulated robots come from `own_robots`, whose seeds are disjoint from every reported trial because
no reported trial is made by it; opened studies of blind trials may be added::

    python -m clie_blocks.analysis.gap.calibration.learn -n 60 --studies out/seed-41 out/seed-42

The evidence on each robot is kept as a file, so that a run continues, and learning anew takes a
minute.  The numbers are few, and held to those set by hand; their worth is told on the group of
robots (a study, or the simulated ones) that they were not learned on.
"""

import argparse
import dataclasses
import json
import re
from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.calibration.examples import read_examples
from clie_blocks.analysis.gap.method.calibration import (
    SCHEMA_VERSION,
    STORED,
    Calibration,
    load_calibration,
)
from clie_blocks.analysis.gap.verdict.evidence import to_json as plain
from clie_blocks.analysis.gap.verdict.posterior import credible_set, marginals, posterior
from clie_blocks.output import progress, run_main, to_json, write

__all__ = ["cross_validate", "diagnose_robots", "learn", "loss", "read_examples"]
LEARNED = ("sharpness", "price", "misfit", "unexplained_share", "parametric", "beyond", "lapse",
           "blunt", "doubt")
LOOSENESS = 0.7  # how far a number may leave its hand-set value, in factors e at one sigma
FOLDS = 5  # where all robots are of one group
SWEEPS = 2  # of the search along each number
LEAST = 1e-3  # probability below which being wrong costs no more
SURE = 0.9  # probability from which a decision counts as stated for certain
CHUNK = 12  # robots simulated side by side
DURATION, SIZE = 15.0, 0.2  # of each log [s], and of the effects


def loss(numbers, examples):
    """Mean negative logarithm of the probability of the truth [nats]."""
    return float(np.mean([_surprise(one.truth, posterior(one.table, numbers))
                          for one in examples]))


def _surprise(truth, ranking):
    right = sum(standing.probability for standing in ranking
                if tuple(sorted(standing.names)) == truth)
    return -np.log(max(right, LEAST))


def learn(examples, names=LEARNED, others=None):
    """Numbers with the least loss, held to those set by hand.

    Parameters
    ----------
    examples : list of Example
        Diagnosed robots.
    names : sequence of str
        Numbers to learn.
    others : Calibration, optional
        The rest; set by hand by default.

    """
    from scipy.optimize import minimize

    hand = Calibration()

    def numbers(steps):
        return dataclasses.replace(others or hand, **{
            name: getattr(hand, name) * float(np.exp(step)) for name, step in zip(names, steps)})

    def price(steps):
        held = np.sum((steps / LOOSENESS) ** 2) / 2 / len(examples)
        return loss(numbers(steps), examples) + held

    found = minimize(price, np.zeros(len(names)), method="Powell",
                     options={"maxiter": SWEEPS, "xtol": 0.03, "ftol": 1e-4})
    return numbers(np.atleast_1d(found.x))


def cross_validate(examples, names=LEARNED, others=None):
    """Return what the numbers are worth, each group judged by numbers learned without it.

    Parameters
    ----------
    examples : list of Example
        Diagnosed robots, with their groups.
    names, others
        As of `learn`.

    Returns
    -------
    dict
        `figures` by group, and of all groups together.

    """
    groups = [one.group for one in examples]
    if len(set(groups)) == 1:
        groups = [f"part {i % FOLDS + 1}" for i in range(len(examples))]
    stated = {}
    for group in sorted(set(groups)):
        rest = [one for one, at in zip(examples, groups) if at != group]
        numbers = learn(rest, names, others)
        stated[group] = [(one.truth, posterior(one.table, numbers))
                         for one, at in zip(examples, groups) if at == group]
    return {**{group: calibration_figures(found) for group, found in stated.items()},
            "all": calibration_figures(sum(stated.values(), []))}


def calibration_figures(stated):
    """Return loss, coverage and size of the 90 % sets, and how sure and right decisions are.

    Parameters
    ----------
    stated : list of (tuple of str, list of Standing)
        Truth and ranking of each robot; decisions and sets count those with one right answer.

    """
    told = {"robots": len(stated), "loss": float(np.mean([_surprise(*one) for one in stated]))}
    single = [(set(truth), ranking) for truth, ranking in stated if len(truth) == 1]
    if not single:
        return told
    best = [max(marginals(ranking).items(), key=lambda item: item[1]) for _, ranking in single]
    sure = [(probability, name in truth) for (name, probability), (truth, _) in zip(best, single)]
    certain = [one for one in sure if one[0] >= SURE]
    sets = [credible_set(ranking) for _, ranking in single]
    return {**told, "right": float(np.mean([right for _, right in sure])),
            "calibration_error": _calibration_error(np.array(sure, float)),
            "certain": len(certain),
            "certain_stated_and_right": np.mean(certain, axis=0).tolist() if certain else None,
            "coverage": float(np.mean([truth <= set(names)
                                       for (truth, _), names in zip(single, sets)])),
            "set_size": float(np.mean([len(names) for names in sets]))}


def _calibration_error(sure):
    """Mean distance of stated from observed shares over tenths of the stated probability."""
    place = np.minimum((sure[:, 0] * 10).astype(int), 9)
    return float(np.abs(np.bincount(place, sure[:, 0] - sure[:, 1])).sum() / len(sure))


def diagnose_robots(count, seed, folder, jobs=1):
    """Simulate and diagnose robots, and keep the evidence on each as a file.

    Parameters
    ----------
    count, seed : int
        Robots, and the seed of all of them.
    folder : path-like
        Where the evidence is kept; what is there already is not made again.
    jobs : int
        Processes.

    """
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    parts = [(seed, first, min(CHUNK, count - first), Path(folder))
             for first in range(0, count, CHUNK)]
    with progress("diagnosing simulated robots", count) as advance:
        if jobs == 1:
            for part in parts:
                advance(_diagnose_part(*part))
            return
        with workers(jobs) as pool:
            for done in as_completed([pool.submit(_diagnose_part, *part) for part in parts]):
                advance(done.result())


def _diagnose_part(seed, first, count, folder):
    from clie_blocks.analysis.gap.calibration.robots import EFFECTS, KINDS, draw_cases

    places = [folder / f"robot-{seed}-{first + i:03d}.json" for i in range(count)]
    if all(place.is_file() for place in places):
        return count
    made = draw_cases(count, [seed, first], sorted(EFFECTS), KINDS, DURATION, SIZE)
    for place, case in zip(places, made):
        if not place.is_file():
            write(place, to_json({**plain(_evidence(case)),
                                  "truth": sorted(case.causes) or ["none"]}))
    return count


def _evidence(case):
    from clie_blocks.analysis.gap.explain import explain
    from clie_blocks.analysis.gap.problem.problem import problem

    return explain(problem(case.robot, case.records))[2]


def main(argv=None):
    """Run the calibration and store it.

    Parameters
    ----------
    argv : list of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        0.

    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=200, help="robots (200)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--robots", type=Path, default=Path("calibration-robots"), metavar="DIR",
                        help="where the evidence on each robot is kept (calibration-robots)")
    parser.add_argument("--studies", type=Path, nargs="*", default=[], metavar="DIR",
                        help="opened studies of blind trials to learn from as well")
    parser.add_argument("--learn", nargs="*", choices=LEARNED, default=[], metavar="NUMBER",
                        help="learn these alone, beside the others as they are stored (all)")
    parser.add_argument("-o", "--output", type=Path, default=STORED)
    asked = parser.parse_args(argv)
    if asked.n:
        diagnose_robots(asked.n, asked.seed, asked.robots, asked.jobs)
    robots = read_examples(asked.robots)
    trials = [one for study in asked.studies for one in read_examples(study)]
    examples = robots + trials
    names, others = asked.learn or LEARNED, load_calibration() if asked.learn else None
    told = {"schema_version": SCHEMA_VERSION, "robots": len(robots), "seed": asked.seed,
            "trials": len(trials), "studies": [study.name for study in asked.studies],
            "seeds": sorted({int(seed) for study in asked.studies
                             for seed in re.findall(r"\d+", study.name)}),
            "learned": list(names), "held_out": cross_validate(examples, names, others),
            "numbers": dataclasses.asdict(learn(examples, names, others))}
    write(asked.output, to_json(told))
    print(json.dumps(told["held_out"], indent=1))
    return 0


if __name__ == "__main__":
    run_main(main)
