"""Learn the calibration of the verdict on robots whose truth is known.

Simulated robots come from `robots`, whose seeds are disjoint from every reported trial because
no reported trial is made by it; opened studies of blind trials may be added::

    python -m clie_blocks.analysis.gap.calibration.learn -n 60 --studies out/seed-41 out/seed-42

The evidence on each robot is stored as a file, so that a run continues, and learning anew takes a
minute.  Few values are learned, and they are held near those set by hand; what they are worth is
reported for the group of robots (a study, or the simulated ones) that they were not learned on.
"""

import argparse
import dataclasses
import json
import re
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.calibration.examples import Example, read_examples
from clie_blocks.analysis.gap.calibration.robots import Case
from clie_blocks.analysis.gap.method.calibration import (
    SCHEMA_VERSION,
    STORED,
    Calibration,
    load_calibration,
)
from clie_blocks.analysis.gap.verdict.evidence import Table
from clie_blocks.analysis.gap.verdict.evidence import to_json as plain
from clie_blocks.analysis.gap.verdict.posterior import (
    RankedCause,
    credible_set,
    marginals,
    posterior,
)
from clie_blocks.analysis.statistical_measures import calibration_error
from clie_blocks.output import progress, run_main, to_json, write

__all__ = ["cross_validate", "diagnose_robots", "learn", "loss", "read_examples"]
LEARNED = ("sharpness", "parameter_cost", "misfit", "unexplained_share", "parametric_cost",
           "prior_violation_cost", "contamination", "contamination_bluntness",
           "leader_uncertainty")
_LOOSENESS = 0.7  # how far a value may leave the one set by hand, in factors e at one sigma
_FOLDS = 5  # where all robots are of one group
_SWEEPS = 2  # of the search along each value
_LEAST = 1e-3  # probability below which being wrong costs no more
_CERTAIN = 0.9  # probability from which a decision counts as stated for certain
_CHUNK = 12  # robots simulated side by side
DURATION, SIZE = 15.0, 0.2  # of each log [s], and of the effects

Stated = tuple[tuple[str, ...], list[RankedCause]]
"""Truth and ranking of a robot."""


def loss(calibration: Calibration, examples: Sequence[Example]) -> float:
    """Mean negative logarithm of the probability of the truth [nats]."""
    return float(np.mean([_surprise(one.truth, posterior(one.table, calibration))
                          for one in examples]))


def _surprise(truth: tuple[str, ...], ranking: Sequence[RankedCause]) -> float:
    right = sum(ranked.probability for ranked in ranking if tuple(sorted(ranked.names)) == truth)
    return -float(np.log(max(right, _LEAST)))


def learn(examples: Sequence[Example], names: Sequence[str] = LEARNED,
          others: Calibration | None = None) -> Calibration:
    """Calibration with the least loss, held near the one set by hand.

    Parameters
    ----------
    examples : list of Example
        Diagnosed robots.
    names : sequence of str
        Values to learn.
    others : Calibration, optional
        The rest; set by hand by default.

    """
    from scipy.optimize import minimize

    by_hand = Calibration()

    def calibration(steps: np.ndarray) -> Calibration:
        return dataclasses.replace(others or by_hand, **{
            name: getattr(by_hand, name) * float(np.exp(step))
            for name, step in zip(names, steps)})

    def penalised_loss(steps: np.ndarray) -> float:
        penalty = np.sum((steps / _LOOSENESS) ** 2) / 2 / len(examples)
        return loss(calibration(steps), examples) + penalty

    best = minimize(penalised_loss, np.zeros(len(names)), method="Powell",
                    options={"maxiter": _SWEEPS, "xtol": 0.03, "ftol": 1e-4})
    return calibration(np.atleast_1d(best.x))


def cross_validate(examples: Sequence[Example], names: Sequence[str] = LEARNED,
                   others: Calibration | None = None) -> dict[str, dict[str, Any]]:
    """Return what a calibration is worth on each group of robots that it was not learned on.

    Takes the arguments of `learn`; returns `calibration_figures` by group, and of all groups
    together.
    """
    groups = [one.group for one in examples]
    if len(set(groups)) == 1:
        groups = [f"part {i % _FOLDS + 1}" for i in range(len(examples))]
    stated = {}
    for group in sorted(set(groups)):
        rest = [one for one, its_group in zip(examples, groups) if its_group != group]
        calibration = learn(rest, names, others)
        stated[group] = [(one.truth, posterior(one.table, calibration))
                         for one, its_group in zip(examples, groups) if its_group == group]
    return {**{group: calibration_figures(rankings) for group, rankings in stated.items()},
            "all": calibration_figures(sum(stated.values(), []))}


def calibration_figures(stated: Sequence[Stated]) -> dict[str, Any]:
    """Return loss, coverage and size of the 90 % sets, and how sure and right decisions are.

    Decisions and sets count the robots with one right answer.
    """
    figures = {"robots": len(stated), "loss": float(np.mean([_surprise(*one) for one in stated]))}
    single = [(set(truth), ranking) for truth, ranking in stated if len(truth) == 1]
    if not single:
        return figures
    best = [max(marginals(ranking).items(), key=lambda item: item[1]) for _, ranking in single]
    decisions = [(probability, name in truth)
                 for (name, probability), (truth, _) in zip(best, single)]
    certain = [one for one in decisions if one[0] >= _CERTAIN]
    sets = [credible_set(ranking) for _, ranking in single]
    return {**figures, "right": float(np.mean([right for _, right in decisions])),
            "calibration_error": calibration_error(decisions),
            "certain": len(certain),
            "certain_stated_and_right": np.mean(certain, axis=0).tolist() if certain else None,
            "coverage": float(np.mean([truth <= set(names)
                                       for (truth, _), names in zip(single, sets)])),
            "set_size": float(np.mean([len(names) for names in sets]))}


def diagnose_robots(count: int, seed: int, folder: str | PathLike[str], jobs: int = 1) -> None:
    """Simulate and diagnose robots, and store the evidence on each as a file.

    Parameters
    ----------
    count, seed : int
        Robots, and the seed of all of them.
    folder : path-like
        Where the evidence is stored; what is there already is not made again.
    jobs : int
        Processes.

    """
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    parts = [(seed, first, min(_CHUNK, count - first), Path(folder))
             for first in range(0, count, _CHUNK)]
    with progress("diagnosing simulated robots", count) as advance:
        if jobs == 1:
            for part in parts:
                advance(_diagnose_part(*part))
            return
        with workers(jobs) as pool:
            for done in as_completed([pool.submit(_diagnose_part, *part) for part in parts]):
                advance(done.result())


def _diagnose_part(seed: int, first: int, count: int, folder: Path) -> int:
    from clie_blocks.analysis.gap.calibration.robots import EFFECTS, KINDS, draw_cases

    files = [folder / f"robot-{seed}-{first + i:03d}.json" for i in range(count)]
    if all(file.is_file() for file in files):
        return count
    cases = draw_cases(count, [seed, first], sorted(EFFECTS), KINDS, DURATION, SIZE)
    for file, case in zip(files, cases):
        if not file.is_file():
            write(file, to_json({**plain(_evidence(case)),
                                 "truth": sorted(case.causes) or ["none"]}))
    return count


def _evidence(case: Case) -> Table:
    from clie_blocks.analysis.gap.explain import explain
    from clie_blocks.analysis.gap.problem.problem import Problem

    return explain(Problem.from_logs(case.robot, case.records)).evidence


def main(argv: Sequence[str] | None = None) -> int:
    """Run the calibration and store it."""
    options = _parser().parse_args(argv)
    if options.n:
        diagnose_robots(options.n, options.seed, options.robots, options.jobs)
    robots = read_examples(options.robots)
    trials = [one for study in options.studies for one in read_examples(study)]
    examples = robots + trials
    names, others = options.learn or LEARNED, load_calibration() if options.learn else None
    method = {"schema_version": SCHEMA_VERSION, "robots": len(robots), "seed": options.seed,
              "trials": len(trials), "studies": [study.name for study in options.studies],
              "seeds": sorted({int(seed) for study in options.studies
                               for seed in re.findall(r"\d+", study.name)}),
              "learned": list(names), "held_out": cross_validate(examples, names, others),
              "values": dataclasses.asdict(learn(examples, names, others))}
    write(options.output, to_json(method))
    print(json.dumps(method["held_out"], indent=1))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m clie_blocks.analysis.gap.calibration.learn", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=200, help="robots to simulate (200)")
    parser.add_argument("--seed", type=int, default=1, help="of the simulated robots (1)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--robots", type=Path, default=Path("calibration-robots"), metavar="DIR",
                        help="where the evidence on each robot is stored (calibration-robots)")
    parser.add_argument("--studies", type=Path, nargs="*", default=[], metavar="DIR",
                        help="opened studies of blind trials to learn from as well")
    parser.add_argument("--learn", nargs="*", choices=LEARNED, default=[], metavar="NAME",
                        help="learn these values only and keep the stored others (all)")
    parser.add_argument("-o", "--output", type=Path, default=STORED,
                        help="file of the calibration (the one of the package)")
    return parser


if __name__ == "__main__":
    run_main(main)
