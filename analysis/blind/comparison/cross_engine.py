"""Calibrated on one engine, tested on the other, to see whether the probability map carries over.

What a verdict rests on is kept with every diagnosis as a table of hypotheses, so that the map can
be learned, and tables weighed again, without a second diagnosis.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.blind.comparison.leave_one_out import FOUND_BY_CHECK
from clie_blocks.analysis.blind.protocol.seeds import OWN_ENGINE
from clie_blocks.analysis.blind.scoring.decisions import truth_of
from clie_blocks.analysis.blind.scoring.intervals import estimate, rate
from clie_blocks.analysis.statistical_measures import calibration_error

if TYPE_CHECKING:
    from clie_blocks.analysis.gap.calibration.examples import Example
    from clie_blocks.analysis.gap.method.calibration import Calibration
    from clie_blocks.analysis.gap.verdict.posterior import RankedCause

LEAST_PROBABILITY = 1e-3  # probability below which a miss costs no more
BY_HAND = "nothing (set by hand)"


def calibrate_across_engines(own: Path, diagnoses: dict[str, Any],
                             labels: dict[str, Any]) -> list[dict[str, Any]]:
    """Learn on each engine and test on the other.

    Parameters
    ----------
    own : pathlib.Path
        Kept robots of the calibration, see `examples.read_examples`.
    diagnoses, labels : dict
        Of a study on robots of MuJoCo, by trial.

    Returns
    -------
    list of dict
        One row per map and engine: loss, share ranked first, calibration error.

    """
    from clie_blocks.analysis.gap.calibration import learn
    from clie_blocks.analysis.gap.method.calibration import Calibration

    robots = {OWN_ENGINE: learn.read_examples(own),
              "MuJoCo": examples(diagnoses, labels)}
    maps = {BY_HAND: Calibration(), **{name: learn.learn(known)
                                       for name, known in robots.items()}}
    return [evaluate_map(calibration, robots[engine], learned_on, engine)
            for engine in ("MuJoCo", OWN_ENGINE) for learned_on, calibration in maps.items()
            if learned_on != engine]


def examples(diagnoses: dict[str, Any], labels: dict[str, Any]) -> "list[Example]":
    """Tables of a study with their truth, except for what the controller check establishes."""
    from clie_blocks.analysis.gap.calibration.examples import Example
    from clie_blocks.analysis.gap.verdict.evidence import from_json

    return [Example(from_json(diagnoses[name]["evidence"]), tuple(sorted(truth_of(label))))
            for name, label in sorted(labels.items())
            if diagnoses[name].get("evidence") and not diagnoses[name].get("decisions")
            and not set(label["labels"]) & set(FOUND_BY_CHECK)]


def evaluate_map(calibration: "Calibration", robots: "Sequence[Example]", learned_on: str,
                 tested_on: str) -> dict[str, Any]:
    """Figures of one probability map on robots that it has not seen, and the two engines."""
    from clie_blocks.analysis.gap.verdict.posterior import posterior

    stated = [(robot.truth, posterior(robot.table, calibration)) for robot in robots]
    points = [(ranking[0].probability, set(ranking[0].names) == set(truth))
              for truth, ranking in stated]
    return {"learned_on": learned_on, "tested_on": tested_on, "robots": len(robots),
            "loss": estimate([_loss(*one) for one in stated], np.mean),
            "top_1": rate(right for _, right in points),
            "ece": estimate(points, calibration_error)}


def _loss(truth: Sequence[str], ranking: "Sequence[RankedCause]") -> float:
    right = sum(one.probability for one in ranking if set(one.names) == set(truth))
    return float(-np.log(max(right, LEAST_PROBABILITY)))
