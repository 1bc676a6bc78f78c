"""Other methods on the trials of a study: those of today, and the diagnosis less a stage."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.comparison.rerun import answer_again
from clie_blocks.analysis.blind.scoring.decisions import Answer, leads, truth_of
from clie_blocks.analysis.blind.scoring.intervals import estimate, rate, share_difference
from clie_blocks.analysis.blind.scoring.score import score

FULL = "clie diagnose"
SHOWN = ("trials", "kinds", "top_1", "top_3", "joint", "pair_all_in_top_2", "false_alarm",
         "unknown_detected", "set_coverage", "against_true_model", "seconds")
BySeed = dict[int, dict[str, dict[str, Any]]]  # diagnoses or labels, by seed, then by trial


def method_names(baselines: bool, ablations: bool) -> list[str]:
    """Names of the methods of two groups, each if it is wanted."""
    from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS
    from clie_blocks.analysis.blind.comparison.baselines import BASELINES

    return [*(BASELINES if baselines else ()), *(ABLATIONS if ablations else ())]


def compare_methods(names: Sequence[str], folders: dict[int, Path], diagnoses: BySeed,
                    labels: BySeed, subset: int | None = None,
                    jobs: int = 1) -> list[dict[str, Any]]:
    """Run methods on trials of a study and score them against the diagnosis.

    Parameters
    ----------
    names : sequence of str
        From `method_names`.
    folders : dict
        Folder of each seed.
    diagnoses, labels : dict
        By seed, then by trial.
    subset : int, optional
        Trials of the whole study, see `sample_evenly`; by default all.
    jobs : int
        Processes.

    Returns
    -------
    list of dict
        One row per method, the diagnosis first.

    """
    sample = sample_evenly(labels, subset)
    answers = answer_again([(method, folders[seed], name) for seed, name in sample
                            for method in names], jobs)
    truth = _by_full_name(labels, sample)
    own = _by_full_name(diagnoses, sample)
    rows = [method_row(FULL, own, truth)]
    for method in names:
        others = dict(zip(truth, (answers[method, folders[seed], name] for seed, name in sample)))
        rows.append(method_row(method, others, truth)
                    | {"paired": paired_differences(own, others, truth)})
    return rows


def sample_evenly(labels: BySeed, count: int | None = None) -> list[tuple[int, str]]:
    """Return trials that represent a whole study, as pairs of seed and name.

    All trials are put in the order of kind, size and effect, and taken at equal distances: every
    kind and size has its share, and effects and seeds come as evenly as the count allows.
    """
    order = sorted(((label["kind"], label["severity"] or "", label["labels"]), seed, name)
                   for seed, trials in labels.items() for name, label in trials.items())
    count = min(count or len(order), len(order))
    return [order[int((k + 0.5) * len(order) / count)][1:] for k in range(count)]


def _by_full_name(entries: BySeed, sample: list[tuple[int, str]]) -> dict[str, dict[str, Any]]:
    """Entries of the sampled trials by seed and name in one word."""
    return {f"{seed}/{name}": entries[seed][name] for seed, name in sample}


def paired_differences(first: dict[str, Any], second: dict[str, Any],
                       labels: dict[str, Any]) -> dict[str, Any]:
    """Return what a second method loses against a first one on the same trials.

    Parameters
    ----------
    first, second : dict
        Answers by trial.
    labels : dict
        Opened labels.

    Returns
    -------
    dict
        ``only_first`` and ``only_second``: trials that one of the two has right (all effects,
        where there are several); ``lost``: difference of the shares that are right, with its
        interval; ``stated``: difference of the mean probability that the truth is given;
        ``gap``: gap on the unseen log by the second over that by the first, geometric mean.

    """
    pairs = [(label, Answer(first[name]), Answer(second[name])) for name, label in labels.items()]
    hits = [(leads(label, one), leads(label, other)) for label, one, other in pairs]
    ratios = [math.log(other.after / one.after) for _, one, other in pairs
              if one.after and other.after]
    return {"only_first": sum(a and not b for a, b in hits),
            "only_second": sum(b and not a for a, b in hits), "lost": share_difference(hits),
            "stated": estimate([probability_of_truth(label, one)
                                - probability_of_truth(label, other)
                                for label, one, other in pairs], np.mean),
            "gap": estimate(ratios, lambda values: math.exp(np.mean(values)))}


def probability_of_truth(label: dict[str, Any], answer: Answer) -> float:
    """Probability that an answer gives the truth; the least one where there are several."""
    return min(answer.probability.get(name, 0.0) for name in truth_of(label))


def method_row(method: str, answers: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Figures of one method, from its answers and the opened labels."""
    scores = score(answers, truth)
    return {"method": method, "ece": scores["calibration"]["ece"],
            "failed": rate("error" in answer for answer in answers.values()),
            **{key: scores[key] for key in SHOWN}}
