"""Learn the numbers of the verdict on simulated robots: ``python -m ...gap.calibrate -n 200``.

The robots come from `own_robots`, whose seeds are disjoint from every reported trial because no
reported trial is made by it; opened studies of blind trials may be added.  The evidence on each
robot is kept as a file, so that a run continues, and learning anew takes seconds.  The numbers are
few, and held to those set by hand; their worth is told on robots that they were not learned on.
"""

import argparse
import dataclasses
import json
from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.evidence import Table, from_json
from clie_blocks.analysis.gap.evidence import to_json as plain
from clie_blocks.analysis.gap.verdict import Calibration, weighed
from clie_blocks.output import progress, run_main, to_json, write

SCHEMA_VERSION = 2
LEARNED = ("sharpness", "price", "second", "misfit", "unexplained_share")
LOOSENESS = 0.7  # how far a number may leave its hand-set value, in factors e at one sigma
FOLDS = 5
LEAST = 1e-3  # probability below which being wrong costs no more
CHUNK = 12  # robots simulated side by side
DURATION, SIZE = 15.0, 0.2  # of each log [s], and of the effects


@dataclasses.dataclass(frozen=True, eq=False)
class Example:
    """A diagnosed robot.

    Parameters
    ----------
    table : Table
        The evidence, without the fits.
    truth : tuple of str
        Its causes, sorted; or ``none``, ``unknown``, ``parametric``.

    """

    table: Table
    truth: tuple


def loss(numbers, examples):
    """Mean negative logarithm of the probability of the truth [nats]."""
    return float(np.mean([-np.log(max(_right(numbers, one), LEAST)) for one in examples]))


def _right(numbers, example):
    return sum(standing.probability for standing in weighed(example.table, numbers)
               if tuple(sorted(standing.names)) == example.truth)


def learn(examples, seed=0):
    """Numbers with the least loss, held to those set by hand.

    Parameters
    ----------
    examples : list of Example
        Diagnosed robots.
    seed : int
        Of the start of the search.

    """
    from scipy.optimize import minimize

    hand = Calibration()

    def numbers(steps):
        return dataclasses.replace(hand, **{
            name: getattr(hand, name) * float(np.exp(step))
            for name, step in zip(LEARNED, steps)})

    def price(steps):
        held = np.sum((steps / LOOSENESS) ** 2) / 2 / len(examples)
        return loss(numbers(steps), examples) + held

    start = 0.1 * np.random.default_rng(seed).standard_normal((6, 5))
    found = minimize(price, start[0], method="Nelder-Mead",
                     options={"initial_simplex": start, "maxfev": 400, "xatol": 1e-2,
                              "fatol": 1e-4})
    return numbers(found.x)


def held_out_loss(examples, seed=0):
    """Loss before and after learning, each robot judged by numbers learned without it."""
    order = np.random.default_rng(seed).permutation(len(examples))
    after = []
    for part in np.array_split(order, FOLDS):
        rest = [examples[i] for i in order if i not in part]
        numbers = learn(rest, seed)
        after += [loss(numbers, [examples[i]]) for i in part]
    return {"before": loss(Calibration(), examples), "after": float(np.mean(after))}


def read_examples(path):
    """Return the examples of a folder of kept robots, or of an opened study of blind trials.

    Parameters
    ----------
    path : path-like
        Folder with ``robot-*.json``, or with ``diagnoses.json`` and ``labels.json``; or one file
        with a list of them.

    """
    path = Path(path)
    if path.is_file():
        kept = json.loads(path.read_text())
    elif (path / "labels.json").is_file():
        kept = list(_of_study(path))
    else:
        kept = [json.loads(file.read_text()) for file in sorted(path.glob("robot-*.json"))]
    return [Example(from_json(one), tuple(one["truth"])) for one in kept]


def _of_study(folder):
    """Trials of a study but those on which the controller check decided, not the evidence."""
    from clie_blocks.analysis.gap.pipeline import FROM_CHECK

    labels = json.loads((folder / "labels.json").read_text())
    diagnoses = json.loads((folder / "diagnoses.json").read_text())
    for name, label in sorted(labels.items()):
        told = diagnoses[name]
        from_check = {row["effect"] for row in told.get("effects", ())} & set(FROM_CHECK)
        if "evidence" in told and not from_check:
            several = label["kind"] in ("single", "pair", "triple")
            yield {**told["evidence"],
                   "truth": sorted(label["labels"]) if several else [label["kind"]]}


def examine(count, seed, folder, jobs=1):
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
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    parts = [(seed, first, min(CHUNK, count - first), Path(folder))
             for first in range(0, count, CHUNK)]
    with progress("diagnosing simulated robots", count) as advance:
        if jobs == 1:
            for part in parts:
                advance(_examine_part(*part))
            return
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            for done in as_completed([pool.submit(_examine_part, *part) for part in parts]):
                advance(done.result())


def _examine_part(seed, first, count, folder):
    from clie_blocks.analysis.gap.own_robots import EFFECTS, KINDS, cases

    places = [folder / f"robot-{seed}-{first + i:03d}.json" for i in range(count)]
    if all(place.is_file() for place in places):
        return count
    made = cases(count, [seed, first], sorted(EFFECTS), KINDS, DURATION, SIZE)
    for place, case in zip(places, made):
        if not place.is_file():
            write(place, to_json({**plain(_evidence(case)),
                                  "truth": sorted(case.causes) or ["none"]}))
    return count


def _evidence(case):
    from clie_blocks.analysis.gap.pipeline import examined
    from clie_blocks.analysis.gap.problem import problem

    return examined(problem(case.robot, case.records))[2]


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
    parser.add_argument("-o", "--output", type=Path,
                        default=Path(__file__).with_name("calibration.json"))
    asked = parser.parse_args(argv)
    if asked.n:
        examine(asked.n, asked.seed, asked.robots, asked.jobs)
    robots = read_examples(asked.robots)
    trials = [one for study in asked.studies for one in read_examples(study)]
    examples = robots + trials
    told = {"schema_version": SCHEMA_VERSION, "robots": len(robots), "seed": asked.seed,
            "trials": len(trials), "studies": [study.name for study in asked.studies],
            "loss": held_out_loss(examples, asked.seed),
            "numbers": dataclasses.asdict(learn(examples, asked.seed))}
    write(asked.output, to_json(told))
    print(json.dumps(told["loss"]))
    return 0


if __name__ == "__main__":
    run_main(main)
