"""Diagnoses against the opened labels: how often right, how honest, how far the gap shrinks."""

from collections import Counter

import numpy as np

from clie_blocks.analysis.blind.scoring.decisions import (
    FAMILY,
    HELD,
    SEVERAL,
    Answer,
    joint_right,
    leads,
    right,
    truth_of,
)
from clie_blocks.analysis.blind.scoring.intervals import figure, rate, spread

BINS = 10
GEARS = ((10.0, "1 to 10"), (50.0, "10 to 50"), (np.inf, "above 50"))
VISIBLE = 0.05  # reduction that the true model must bring, for a share of it to mean anything
DECIDED = ("single", "none", "unknown", "parametric")  # kinds with one right decision


def score(diagnoses, labels):
    """Score a study.

    Parameters
    ----------
    diagnoses : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial.

    Returns
    -------
    dict
        Rates with Wilson 95 % intervals, confusions, calibration, shrinkage, time.

    """
    rows = [(name, label, Answer(diagnoses[name])) for name, label in sorted(labels.items())]

    def of(*kinds):
        return [(label, answer) for _, label, answer in rows if label["kind"] in kinds]

    return {
        "trials": len(rows), "kinds": dict(Counter(label["kind"] for label in labels.values())),
        "failed": [name for name, _, answer in rows if answer.failed],
        "all_decisions": rate(right(*row) for row in of(*DECIDED)),
        **_singles(of("single")), **_alarms(of), **_several(of("pair"), "pair", 2),
        **_several(of("triple"), "triple", 3),
        "set_coverage": rate(_covered(*row) for row in of(*DECIDED)),
        "set_coverage_all": rate(_covered(*row) for row in of(*DECIDED, *SEVERAL)),
        "set_size": figure([len(a.set_90) for _, a in of(*DECIDED)], np.mean),
        "calibration": calibration(of(*DECIDED)),
        "shrinkage": shrinkage(of(*HELD)), "against_true_model": against_true(of(*HELD)),
        "seconds": spread(answer.seconds for _, _, answer in rows),
        "confusion": confusion(of(*DECIDED)),
        "wrong": [_wrong(*row) for row in rows if not leads(*row[1:])],
        "vocabulary": sorted(FAMILY)}


def _singles(single):
    found = [row for row in single if right(*row)]
    plain = [row for row in single if row[0]["severity"] != "mild"]
    mild = [row for row in single if row[0]["severity"] == "mild"]
    return {
        "top_1": rate(right(*row) for row in single),
        "top_1_medium_strong": rate(right(*row) for row in plain),
        "top_1_mild": rate(right(*row) for row in mild),
        "top_3": rate(label["labels"][0] in answer.order[:3] for label, answer in single),
        "family": rate(FAMILY.get(answer.decision) == FAMILY[label["labels"][0]]
                       for label, answer in single),
        "joint": rate(joint_right(*row) for row in found if row[0]["effects"][0]["joints"]),
        "effect_and_joint": rate(right(*row) and joint_right(*row) for row in single),
        "by_size": _by(single, lambda label: [label["severity"]]),
        "by_robot": _by(single, lambda label: [label["robot"]]),
        "by_gear": _by(single, _gear),
        "by_excitation": _by(single, lambda label: label["excitations"][:2]),
        "by_effect": _by(single, lambda label: label["labels"])}


def _alarms(of):
    claimed = ("none", "parametric")
    return {
        "false_alarm": rate(answer.decision not in claimed for _, answer in of("none")),
        "false_structure": rate(answer.decision not in claimed for _, answer in of("parametric")),
        "parametric_named": rate(right(*row) for row in of("parametric")),
        "unknown_detected": rate(right(*row) for row in of("unknown")),
        "unknown_called_none": rate(answer.decision == "none" for _, answer in of("unknown")),
        "false_unknown": rate(answer.decision == "unknown"
                              for _, answer in of("single", "none", "parametric"))}


def _several(rows, kind, size):
    return {
        f"{kind}_recall": rate(answer.probability.get(name, 0.0) >= 0.5
                               for label, answer in rows for name in label["labels"]),
        f"{kind}_all_in_top_{size}": rate(leads(*row) for row in rows),
        f"{kind}_top_1_is_one": rate(right(*row) for row in rows),
        f"{kind}_all_in_set_90": rate(_covered(*row) for row in rows)}


def _covered(label, answer):
    return truth_of(label) <= set(answer.set_90)


def calibration(rows):
    """Brier score, expected calibration error and reliability of the decisions."""
    points = [(answer.confidence, right(label, answer)) for label, answer in rows]
    place = [min(int(stated * BINS), BINS - 1) for stated, _ in points]
    table = []
    for b in sorted(set(place)):
        inside = [point for point, at in zip(points, place) if at == b]
        table.append({"from": b / BINS, "to": (b + 1) / BINS,
                      "stated": float(np.mean([stated for stated, _ in inside])),
                      "observed": rate(hit for _, hit in inside)})
    return {"brier": figure(points, brier), "ece": figure(points, calibration_error),
            "reliability": table}


def brier(points):
    """Mean squared distance of stated probabilities from what happened."""
    stated, happened = np.array(points, float).T
    return float(np.mean((stated - happened) ** 2))


def calibration_error(points):
    """Mean distance of stated from observed shares over bins of the stated probability."""
    stated, happened = np.array(points, float).T
    place = np.minimum((stated * BINS).astype(int), BINS - 1)
    gaps = np.bincount(place, stated - happened, BINS)
    return float(np.abs(gaps).sum() / len(points))


def shrinkage(rows):
    """Achieved over achievable reduction of the gap on the unseen log, and both for each trial."""
    points = [(label["gap"]["achievable_reduction"], 1 - answer.after / answer.before,
               leads(label, answer)) for label, answer in rows
              if answer.before and answer.after is not None]
    return {**spread(achieved / achievable for achievable, achieved, _ in points
                     if achievable > VISIBLE), "points": points}


def against_true(rows):
    """Gap on the unseen log after a right diagnosis, over the gap that the true model leaves."""
    return spread(answer.after / label["gap"]["true_model"] for label, answer in rows
                  if answer.after is not None and leads(label, answer))


def confusion(rows):
    """Counts of decisions by truth."""
    found = {}
    for label, answer in rows:
        name = label["labels"][0] if label["kind"] == "single" else label["kind"]
        found.setdefault(name, Counter())[answer.decision] += 1
    return {name: dict(counts.most_common()) for name, counts in sorted(found.items())}


def _gear(label):
    """Class of the gear ratio, the middle one of the robot's joints."""
    if "gear_ratios" not in label:
        return []
    middle = float(np.median(label["gear_ratios"]))
    return [next(name for limit, name in GEARS if middle <= limit)]


def _by(rows, keys):
    groups = {}
    for label, answer in rows:
        for key in keys(label):
            groups.setdefault(key, []).append(right(label, answer))
    return {key: rate(flags) for key, flags in sorted(groups.items())}


def _wrong(name, label, answer):
    rank = [answer.order.index(true) + 1 if true in answer.order else None
            for true in sorted(truth_of(label))]
    return {"trial": name, "kind": label["kind"], "true": label["labels"],
            "said": answer.decision, "probability": answer.confidence,
            "top": answer.order[:3], "rank_of_truth": rank, "ratio": label["ratio"],
            "robot": label["robot"], "set_90": answer.set_90}
