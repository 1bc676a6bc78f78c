"""Diagnoses against the opened labels: how often right, how honest, how far the gap shrinks."""

import math
from collections import Counter

import numpy as np

from clie_blocks.analysis.blind.hidden import EFFECTS

FAMILIES = {
    "friction": ("coulomb", "stribeck", "asymmetric_coulomb", "quadratic_drag",
                 "load_dependent_friction", "presliding", "friction_drift"),
    "load": ("gravity", "payload", "coupling", "spring"),
    "transmission": ("joint_elasticity", "backlash"),
    "timing": ("actuator_lag", "time_delay", "velocity_filter_mismatch"),
    "actuator": ("actuator_saturation", "dead_zone", "torque_ripple", "torque_gain_error"),
    "sensor": ("encoder_quantization", "encoder_eccentricity"),
    "external": ("periodic_disturbance",), "step_fault": ("step_fault",)}
FAMILY = {name: family for family, names in FAMILIES.items() for name in names}
ANSWERS = ("none", "unknown", "parametric")  # that are no effects
BINS = 5


class Answer:
    """One diagnosis, made comparable.

    Parameters
    ----------
    diagnosis : dict
        JSON object of ``clie diagnose``.

    """

    def __init__(self, diagnosis):
        self.failed = "error" in diagnosis
        rows = diagnosis.get("effects", [])
        self.probability = {row["effect"]: min(max(row["probability"], 0.0), 1.0) for row in rows}
        self.joints = {row["effect"]: set(row["joint"] or ()) for row in rows}
        self.rank = sorted(self.probability, key=lambda name: -self.probability[name])
        self.known = [name for name in self.rank if name not in ANSWERS]
        self.set_90 = diagnosis.get("set_90", [])
        self.before, self.after = diagnosis.get("gap_before"), diagnosis.get("gap_after")
        self.seconds = diagnosis.get("seconds")
        self.decision = "failed" if self.failed else self._decision(diagnosis)
        self.confidence = self.probability.get(self.decision, 0.0)

    def _decision(self, diagnosis):
        top = self.probability.get(self.known[0], 0.0) if self.known else 0.0
        if diagnosis["unexplained"] and top < 0.5:
            return "unknown"
        return max(self.rank, key=lambda name: self.probability[name])


def truth_of(label):
    """Right decision on a trial: an effect, or a word for its kind; pairs have two."""
    return set(label["labels"]) if label["kind"] in ("single", "pair") else {label["kind"]}


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

    single, pair, decided = of("single"), of("pair"), of("single", "none", "unknown", "parametric")
    found = [(label, answer) for label, answer in single if right(label, answer)]
    return {
        "trials": len(rows), "kinds": dict(Counter(label["kind"] for label in labels.values())),
        "failed": [name for name, _, answer in rows if answer.failed],
        "top_1": rate(right(*row) for row in single),
        "top_3": rate(label["labels"][0] in answer.rank[:3] for label, answer in single),
        "family": rate(FAMILY.get(answer.decision) == FAMILY[label["labels"][0]]
                       for label, answer in single),
        "joint": rate(_joint_right(*row) for row in found if row[0]["effects"][0]["joints"]),
        "effect_and_joint": rate(right(*row) and _joint_right(*row) for row in single),
        "all_decisions": rate(right(*row) for row in decided),
        "by_size": _by(single, lambda label: [label["severity"]]),
        "by_robot": _by(single, lambda label: [label["robot"]]),
        "by_excitation": _by(single, lambda label: label["excitations"][:2]),
        "by_effect": _by(single, lambda label: label["labels"]),
        "false_alarm": rate(answer.decision not in ("none", "parametric")
                            for _, answer in of("none")),
        "false_structure": rate(answer.decision not in ("none", "parametric")
                                for _, answer in of("parametric")),
        "parametric_named": rate(right(*row) for row in of("parametric")),
        "unknown_detected": rate(right(*row) for row in of("unknown")),
        "unknown_called_none": rate(answer.decision == "none" for _, answer in of("unknown")),
        "false_unknown": rate(answer.decision == "unknown"
                              for _, answer in of("single", "none", "parametric")),
        "pair_recall": rate(answer.probability.get(name, 0.0) >= 0.5
                            for label, answer in pair for name in label["labels"]),
        "pair_both_in_top_2": rate(set(label["labels"]) == set(answer.known[:2])
                                   for label, answer in pair),
        "pair_top_1_is_one": rate(answer.decision in label["labels"] for label, answer in pair),
        "set_coverage": rate(truth_of(label) <= set(answer.set_90) for label, answer in decided),
        "set_size": _mean(len(answer.set_90) for _, answer in decided),
        "calibration": calibration(decided),
        "shrinkage": shrinkage(of("single", "pair")),
        "seconds": _spread([answer.seconds for _, _, answer in rows]),
        "confusion": confusion(decided),
        "wrong": [_wrong(name, label, answer) for name, label, answer in rows
                  if not (right(label, answer) if label["kind"] != "pair" else
                          set(label["labels"]) == set(answer.known[:2]))],
        "vocabulary": sorted(EFFECTS)}


def left_out(diagnoses, labels):
    """What is said of an effect that the library does not hold, see `study.leave_out`.

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
    return {
        "left_out_unknown": rate(a.decision == "unknown" for a in said.values()),
        "left_out_none": rate(a.decision in ("none", "parametric") for a in said.values()),
        "left_out_family": rate(FAMILY.get(a.decision) == FAMILY[labels[name]["labels"][0]]
                                for name, a in said.items()),
        "left_out": [{"effect": labels[name]["labels"][0], "said": a.decision,
                      "probability": a.confidence, "ratio": labels[name]["ratio"]}
                     for name, a in said.items()]}


def right(label, answer):
    """Whether the decision is the truth, or one of a pair."""
    return answer.decision in truth_of(label)


def rate(flags):
    """Hits, count, share and Wilson 95 % interval; share None where there is nothing."""
    flags = [bool(flag) for flag in flags]
    hits, count = sum(flags), len(flags)
    if not count:
        return {"rate": None, "hits": 0, "of": 0, "interval": None}
    z, p = 1.959964, hits / count
    scale = 1 + z * z / count
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / scale
    middle = (p + z * z / (2 * count)) / scale
    return {"rate": p, "hits": hits, "of": count,
            "interval": [max(0.0, middle - half), min(1.0, middle + half)]}


def calibration(rows):
    """Brier score, expected calibration error and reliability of the decisions."""
    stated = np.array([answer.confidence for _, answer in rows])
    correct = np.array([right(*row) for row in rows], float)
    if not len(rows):
        return {"brier": None, "ece": None, "reliability": []}
    place = np.minimum((stated * BINS).astype(int), BINS - 1)
    table = [{"from": b / BINS, "to": (b + 1) / BINS, "stated": stated[place == b].mean(),
              "observed": rate(correct[place == b])} for b in range(BINS) if np.any(place == b)]
    ece = sum(row["observed"]["of"] * abs(row["stated"] - row["observed"]["rate"])
              for row in table) / len(rows)
    return {"brier": float(np.mean((stated - correct) ** 2)), "ece": ece, "reliability": table}


def shrinkage(rows):
    """Achieved over achievable reduction of the gap on the unseen log."""
    shares = []
    for label, answer in rows:
        gap = label["gap"]
        if answer.before and answer.after is not None and gap["achievable_reduction"] > 0.05:
            shares.append((1 - answer.after / answer.before) / gap["achievable_reduction"])
    return {"of": len(shares), **_spread(shares)}


def confusion(rows):
    """Counts of decisions by truth."""
    found = {}
    for label, answer in rows:
        name = label["labels"][0] if label["kind"] == "single" else label["kind"]
        found.setdefault(name, Counter())[answer.decision] += 1
    return {name: dict(counts.most_common()) for name, counts in sorted(found.items())}


def _joint_right(label, answer):
    true = set(label["effects"][0]["joints"])
    said = answer.joints.get(answer.decision, set())
    return not true or (bool(said) and said <= true)


def _by(rows, keys):
    groups = {}
    for label, answer in rows:
        for key in keys(label):
            groups.setdefault(key, []).append(right(label, answer))
    return {key: rate(flags) for key, flags in sorted(groups.items())}


def _wrong(name, label, answer):
    rank = [answer.rank.index(true) + 1 if true in answer.rank else None
            for true in sorted(truth_of(label))]
    return {"trial": name, "kind": label["kind"], "true": label["labels"],
            "said": answer.decision, "probability": answer.confidence,
            "top": answer.rank[:3], "rank_of_truth": rank, "ratio": label["ratio"],
            "robot": label["robot"], "set_90": answer.set_90}


def _mean(values):
    values = list(values)
    return sum(values) / len(values) if values else None


def _spread(values):
    values = [value for value in values if value is not None]
    if not values:
        return {"median": None, "mean": None, "largest": None}
    return {"median": float(np.median(values)), "mean": _mean(values), "largest": max(values)}
