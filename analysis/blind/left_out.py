"""Each effect taken out of the library: the diagnosis should say that it knows no such thing."""

from clie_blocks.analysis.blind.answers import FAMILY, Answer
from clie_blocks.analysis.blind.rates import rate

KEPT = ("velocity_filter_mismatch", "encoder_quantization")  # found by a check, not by the library


def chosen(labels, most=None):
    """Return the trials with one effect of the library, at most so many of each effect.

    Parameters
    ----------
    labels : dict
        Opened labels.
    most : int, optional
        Trials per effect.

    Returns
    -------
    dict
        Names of trials by effect.

    """
    hidden = {}
    for name, label in sorted(labels.items()):
        if label["kind"] == "single" and label["labels"][0] not in KEPT:
            hidden.setdefault(label["labels"][0], []).append(name)
    return {effect: names[:most] for effect, names in sorted(hidden.items())}


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
