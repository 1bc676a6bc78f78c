"""Learn the numbers of the verdict on simulated robots: ``python -m ...gap.calibrate -n 200``.

The robots come from `own_robots`, whose seeds are disjoint from every reported trial because no
reported trial is made by it.  The diagnosis of each robot is kept as a table of hypotheses with
their excess and size; the numbers are those that give the truth the largest probability.
"""

import argparse
import dataclasses
import json
from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.own_robots import EFFECTS, KINDS, cases
from clie_blocks.analysis.gap.pipeline import diagnose
from clie_blocks.analysis.gap.verdict import Calibration, standings
from clie_blocks.output import progress, run_main, to_json, write

SCHEMA_VERSION = 1
LEARNED = ("sharpness", "floor", "price", "second", "slight", "unexplained_share",
           "unexplained_least")
HELD = 0.25  # share of the robots that only judge
ROUNDS = 400


@dataclasses.dataclass(frozen=True, eq=False)
class Example:
    """A diagnosed robot: what was fitted, and the truth."""

    base: object
    fits: list
    truth: tuple


def examples(count, seed):
    """Diagnose simulated robots and keep what their verdicts rest on."""
    found = []
    with progress("diagnosing simulated robots", count) as advance:
        for made in cases(count, seed, sorted(EFFECTS), KINDS):
            result = diagnose(made.robot, made.records, calibration=Calibration())
            fits = [standing.fit for standing in result.ranking
                    if standing.fit is not None and standing.fit.hypothesis.members]
            found.append(Example(result.base, fits, tuple(sorted(made.causes)) or ("none",)))
            advance(1)
    return found


def loss(numbers, robots):
    """Mean negative logarithm of the probability of the truth [nats]."""
    values = []
    for robot in robots:
        ranking = standings(robot.base, robot.fits, numbers)
        right = sum(s.probability for s in ranking if tuple(sorted(s.names)) == robot.truth)
        values.append(-np.log(max(right, 1e-3)))
    return float(np.mean(values))


def learn(robots, seed):
    """Numbers with the least loss, by a random walk in their logarithms."""
    rng = np.random.default_rng(seed)
    best = Calibration()
    least = loss(best, robots)
    for _ in range(ROUNDS):
        step = {name: getattr(best, name) * float(np.exp(0.3 * rng.standard_normal()))
                for name in rng.choice(LEARNED, 2, replace=False)}
        tried = dataclasses.replace(best, **step)
        found = loss(tried, robots)
        if found < least:
            best, least = tried, found
    return best


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
    parser.add_argument("-n", type=int, default=200, help="robots")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path,
                        default=Path(__file__).with_name("calibration.json"))
    asked = parser.parse_args(argv)
    robots = examples(asked.n, asked.seed)
    judging = robots[:max(1, round(HELD * len(robots)))]
    learning = robots[len(judging):]
    numbers = learn(learning, asked.seed)
    told = {"schema_version": SCHEMA_VERSION, "robots": asked.n, "seed": asked.seed,
            "loss": {"before": loss(Calibration(), judging), "after": loss(numbers, judging)},
            "numbers": dataclasses.asdict(numbers)}
    write(asked.output, to_json(told))
    print(json.dumps(told["loss"]))
    return 0


if __name__ == "__main__":
    run_main(main)
