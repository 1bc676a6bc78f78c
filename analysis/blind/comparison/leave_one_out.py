"""Each effect taken out of the library: the diagnosis should say that it knows no such thing."""

import itertools

from clie_blocks.analysis.blind.comparison.rerun import WITHOUT, repeated
from clie_blocks.analysis.blind.scoring.decisions import FAMILY, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate

KEPT = ("velocity_filter_mismatch", "encoder_quantization")  # found by a check, not by the library


def diagnosed(places, labels, jobs=1, most=None):
    """Diagnose robots with one effect again, with that effect taken out of the library.

    Parameters
    ----------
    places : dict
        Folder of each seed.
    labels : dict
        Opened labels, by seed, then by trial.
    jobs : int
        Processes.
    most : int, optional
        Trials per effect, see `chosen`.

    Returns
    -------
    dict
        Answers by seed, then by trial; the right one is "unknown".

    """
    tasks = {(seed, name): (WITHOUT + effect, places[seed], name)
             for effect, trials in chosen(labels, most).items() for seed, name in trials}
    answers, found = repeated(list(tasks.values()), jobs), {seed: {} for seed in places}
    for (seed, name), task in tasks.items():
        found[seed][name] = answers[task]
    return found


def chosen(labels, most=None):
    """Return the trials with one effect of the library, at most so many of each effect.

    They are taken from the seeds in turn, and each effect begins with another seed.

    Parameters
    ----------
    labels : dict
        Opened labels, by seed, then by trial.
    most : int, optional
        Trials per effect in the whole study.

    Returns
    -------
    dict
        Pairs of seed and name of the trial, by effect.

    """
    hidden = {}
    for seed, trials in labels.items():
        for name, label in sorted(trials.items()):
            if label["kind"] == "single" and label["labels"][0] not in KEPT:
                hidden.setdefault(label["labels"][0], {}).setdefault(seed, []).append(name)
    found = {}
    for turn, (effect, by_seed) in enumerate(sorted(hidden.items())):
        first = turn % len(labels)
        order = [*labels][first:] + [*labels][:first]
        rounds = itertools.zip_longest(*(by_seed.get(seed, ()) for seed in order))
        found[effect] = [(seed, name) for names in rounds
                         for seed, name in zip(order, names) if name is not None][:most]
    return found


def scored(diagnoses, labels):
    """Say what is said of an effect that the library does not hold.

    Parameters
    ----------
    diagnoses : dict
        Answers by trial, each without the trial's own effect in the library.
    labels : dict
        Opened labels.

    Returns
    -------
    dict
        Share called unknown, share called none, and what else was said of each effect.

    """
    said = {name: Answer(diagnosis) for name, diagnosis in sorted(diagnoses.items())}
    plain = [a for name, a in said.items() if labels[name]["severity"] != "mild"]
    return {
        "left_out_unknown": rate(a.decision == "unknown" for a in said.values()),
        "left_out_unknown_medium_strong": rate(a.decision == "unknown" for a in plain),
        "left_out_none": rate(a.decision in ("none", "parametric") for a in said.values()),
        "left_out_family": rate(FAMILY.get(a.decision) == FAMILY[labels[name]["labels"][0]]
                                for name, a in said.items()),
        "left_out": [{"trial": name, "effect": labels[name]["labels"][0], "said": a.decision,
                      "probability": a.confidence, "ratio": labels[name]["ratio"]}
                     for name, a in said.items()]}
