"""Other methods on the trials of a study: those of today, and the diagnosis less a stage."""

import math

import numpy as np

from clie_blocks.analysis.blind.comparison.rerun import repeated
from clie_blocks.analysis.blind.scoring.decisions import Answer, leads, truth_of
from clie_blocks.analysis.blind.scoring.intervals import difference, figure, rate
from clie_blocks.analysis.blind.scoring.score import score

FULL = "clie diagnose"
SHOWN = ("trials", "kinds", "top_1", "top_3", "joint", "pair_all_in_top_2", "false_alarm",
         "unknown_detected", "set_coverage", "against_true_model", "seconds")


def methods(baselines, ablations):
    """Names of the methods to run.

    Parameters
    ----------
    baselines, ablations : bool
        Which groups.

    """
    from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS
    from clie_blocks.analysis.blind.comparison.baselines import BASELINES

    return [*(BASELINES if baselines else ()), *(ABLATIONS if ablations else ())]


def compared(names, places, diagnoses, labels, subset=None, jobs=1):
    """Run methods on trials of a study and score them beside the diagnosis.

    Parameters
    ----------
    names : list of str
        From `methods`.
    places : dict
        Folder of each seed.
    diagnoses, labels : dict
        By seed, then by trial.
    subset : int, optional
        Trials of the whole study, see `spread_over`; by default all.
    jobs : int
        Processes.

    Returns
    -------
    list of dict
        One row per method, the diagnosis first.

    """
    chosen = spread_over(labels, subset)
    tasks = [(method, places[seed], name) for seed, name in chosen for method in names]
    answers = repeated(tasks, jobs)
    truth = _named(labels, chosen)
    own = _named(diagnoses, chosen)
    rows = [row(FULL, own, truth)]
    for method in names:
        found = dict(zip(truth, (answers[method, places[seed], name] for seed, name in chosen)))
        rows.append(row(method, found, truth) | {"paired": paired(own, found, truth)})
    return rows


def spread_over(labels, count=None):
    """Return trials that stand for a whole study, as pairs of seed and name.

    All trials are put in the order of kind, size and effect, and taken at equal distances: every
    kind and size has its share, and effects and seeds come as evenly as the number allows.

    Parameters
    ----------
    labels : dict
        Opened labels, by seed, then by trial.
    count : int, optional
        How many; by default all.

    """
    order = sorted(((label["kind"], label["severity"] or "", label["labels"]), seed, name)
                   for seed, trials in labels.items() for name, label in trials.items())
    count = min(count or len(order), len(order))
    return [order[int((k + 0.5) * len(order) / count)][1:] for k in range(count)]


def _named(entries, chosen):
    """Entries of the chosen trials by seed and name in one word."""
    return {f"{seed}/{name}": entries[seed][name] for seed, name in chosen}


def paired(first, second, labels):
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
            "only_second": sum(b and not a for a, b in hits), "lost": difference(hits),
            "stated": figure([given(label, one) - given(label, other)
                              for label, one, other in pairs], np.mean),
            "gap": figure(ratios, lambda values: math.exp(np.mean(values)))}


def given(label, answer):
    """Probability that an answer gives the truth; the least one where there are several."""
    return min(answer.probability.get(name, 0.0) for name in truth_of(label))


def row(method, answers, truth):
    """Figures of one method."""
    found = score(answers, truth)
    return {"method": method, "ece": found["calibration"]["ece"],
            "failed": rate("error" in answer for answer in answers.values()),
            **{key: found[key] for key in SHOWN}}
