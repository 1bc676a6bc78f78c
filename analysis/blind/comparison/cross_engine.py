"""Calibrated on one engine, tested on the other, to see whether the probability map carries over.

What a verdict rests on is kept with every diagnosis as a table of hypotheses, so that the map can
be learned, and tables weighed anew, without a second diagnosis.
"""

import numpy as np

from clie_blocks.analysis.blind.comparison.leave_one_out import KEPT
from clie_blocks.analysis.blind.protocol.seeds import OWN
from clie_blocks.analysis.blind.scoring.decisions import truth_of
from clie_blocks.analysis.blind.scoring.intervals import figure, rate
from clie_blocks.analysis.blind.scoring.score import calibration_error

LEAST = 1e-3  # probability below which a miss costs no more
BY_HAND = "nothing (set by hand)"


def compared(own, diagnoses, labels):
    """Learn on each engine and judge on the other.

    Parameters
    ----------
    own : path-like
        Kept robots of the calibration, see `calibrate.read_examples`.
    diagnoses, labels : dict
        Of a study on robots of MuJoCo, by trial.

    Returns
    -------
    list of dict
        One row per way: loss, share right first, calibration error.

    """
    from clie_blocks.analysis.gap.calibration import learn
    from clie_blocks.analysis.gap.method.calibration import Calibration

    robots = {OWN: learn.read_examples(own),
              "MuJoCo": examples(diagnoses, labels)}
    maps = {BY_HAND: Calibration(), **{name: learn.learn(known)
                                       for name, known in robots.items()}}
    return [judged(numbers, robots[engine], learned_on, engine)
            for engine in ("MuJoCo", OWN) for learned_on, numbers in maps.items()
            if learned_on != engine]


def examples(diagnoses, labels):
    """Tables of a study with their truth, but for what the controller check establishes."""
    from clie_blocks.analysis.gap.calibration.examples import Example
    from clie_blocks.analysis.gap.verdict.evidence import from_json

    return [Example(from_json(diagnoses[name]["evidence"]), tuple(sorted(truth_of(label))))
            for name, label in sorted(labels.items())
            if diagnoses[name].get("evidence") and not diagnoses[name].get("decisions")
            and not set(label["labels"]) & set(KEPT)]


def judged(numbers, robots, learned_on, tested_on):
    """Figures of one map on robots that it has not seen.

    Parameters
    ----------
    numbers : Calibration
        The map.
    robots : list of Example
        Tables and truths.
    learned_on, tested_on : str
        Engines.

    """
    from clie_blocks.analysis.gap.verdict.posterior import posterior

    stated = [(robot.truth, posterior(robot.table, numbers)) for robot in robots]
    points = [(ranking[0].probability, set(ranking[0].names) == set(truth))
              for truth, ranking in stated]
    return {"learned_on": learned_on, "tested_on": tested_on, "robots": len(robots),
            "loss": figure([_loss(*one) for one in stated], np.mean),
            "top_1": rate(right for _, right in points),
            "ece": figure(points, calibration_error)}


def _loss(truth, ranking):
    right = sum(one.probability for one in ranking if set(one.names) == set(truth))
    return float(-np.log(max(right, LEAST)))
