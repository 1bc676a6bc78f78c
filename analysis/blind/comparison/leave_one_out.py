"""Each effect removed from the library: the diagnosis should report it as unknown."""

import itertools
from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.comparison.rerun import WITHOUT, answer_again
from clie_blocks.analysis.blind.scoring.decisions import FAMILY, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate

# found by a check, not by the library
FOUND_BY_CHECK = ("velocity_filter_mismatch", "encoder_quantization")


def diagnose_without_own_effect(folders: dict[int, Path], labels: dict[int, dict[str, Any]],
                                jobs: int = 1,
                                most: int | None = None) -> dict[int, dict[str, Any]]:
    """Diagnose robots with one effect again, with that effect removed from the library.

    Parameters
    ----------
    folders : dict
        Folder of each seed.
    labels : dict
        Opened labels, by seed, then by trial.
    jobs : int
        Processes.
    most : int, optional
        Trials per effect, see `select_trials`.

    Returns
    -------
    dict
        Answers by seed, then by trial; the right one is "unknown".

    """
    tasks = {(seed, name): (WITHOUT + effect, folders[seed], name)
             for effect, trials in select_trials(labels, most).items() for seed, name in trials}
    answers = answer_again(list(tasks.values()), jobs)
    by_seed: dict[int, dict[str, Any]] = {seed: {} for seed in folders}
    for (seed, name), task in tasks.items():
        by_seed[seed][name] = answers[task]
    return by_seed


def select_trials(labels: dict[int, dict[str, Any]],
                  most: int | None = None) -> dict[str, list[tuple[int, str]]]:
    """Return the trials with one effect of the library, by effect, as pairs of seed and name.

    At most so many of each effect in the whole study; they are taken from the seeds in turn, and
    each effect begins with another seed.
    """
    hidden: dict[str, dict[int, list[str]]] = {}
    for seed, trials in labels.items():
        for name, label in sorted(trials.items()):
            if label["kind"] == "single" and label["labels"][0] not in FOUND_BY_CHECK:
                hidden.setdefault(label["labels"][0], {}).setdefault(seed, []).append(name)
    selected = {}
    for turn, (effect, by_seed) in enumerate(sorted(hidden.items())):
        first = turn % len(labels)
        order = [*labels][first:] + [*labels][:first]
        rounds = itertools.zip_longest(*(by_seed.get(seed, ()) for seed in order))
        selected[effect] = [(seed, name) for names in rounds
                            for seed, name in zip(order, names) if name is not None][:most]
    return selected


def score_left_out(diagnoses: dict[str, Any], labels: dict[str, Any]) -> dict[str, Any]:
    """Return how an effect is reported that the library does not contain.

    Parameters
    ----------
    diagnoses : dict
        Answers by trial, each without the trial's own effect in the library.
    labels : dict
        Opened labels.

    Returns
    -------
    dict
        Share reported as unknown, share missed, and each single decision.

    """
    answers = {name: Answer(diagnosis) for name, diagnosis in sorted(diagnoses.items())}
    larger = [a for name, a in answers.items() if labels[name]["severity"] != "mild"]
    return {
        "left_out_unknown": rate(a.decision == "unknown" for a in answers.values()),
        "left_out_unknown_medium_strong": rate(a.decision == "unknown" for a in larger),
        "left_out_none": rate(a.decision in ("none", "parametric") for a in answers.values()),
        "left_out_family": rate(FAMILY.get(a.decision) == FAMILY[labels[name]["labels"][0]]
                                for name, a in answers.items()),
        "left_out": [{"trial": name, "effect": labels[name]["labels"][0], "said": a.decision,
                      "probability": a.confidence, "ratio": labels[name]["ratio"]}
                     for name, a in answers.items()]}
