"""Diagnoses against the opened labels: how often right, how well calibrated, what is gained."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes, label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import (
    FAMILY,
    IN_LIBRARY,
    NO_EFFECTS,
    SEVERAL,
    Answer,
    effect_of_number,
    is_right,
    joints_right,
    leads,
    truth_of,
)
from clie_blocks.analysis.blind.scoring.intervals import estimate, rate, summary
from clie_blocks.analysis.statistical_measures import BINS, brier, calibration_error

GEARS = ((10.0, "1 to 10"), (50.0, "10 to 50"), (np.inf, "above 50"))
VISIBLE = 0.05  # reduction that the true model must bring, for a share of it to mean anything
DECIDED = ("single", "none", "unknown", "parametric")  # kinds with one right decision
Label = dict[str, Any]
Row = tuple[Label, Answer]


def score(diagnoses: dict[str, dict[str, Any]], labels: dict[str, Label],
          class_of: ClassOf = str) -> dict[str, Any]:
    """Score a study.

    Parameters
    ----------
    diagnoses : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial.
    class_of : callable, optional
        Class of a name: names that no log tells apart have one, and any of them is right where
        another is true.  By default every name is a class of its own.

    Returns
    -------
    dict
        Rates with Wilson 95 % intervals, confusions, calibration, gap reduction, time.

    """
    trials = [(name, label_as_classes(label, class_of),
               Answer(as_classes(diagnoses[name], class_of)))
              for name, label in sorted(labels.items())]

    def of(*kinds: str) -> list[Row]:
        return [(label, answer) for _, label, answer in trials if label["kind"] in kinds]

    return {
        "trials": len(trials), "kinds": dict(Counter(label["kind"] for label in labels.values())),
        "failed": [name for name, _, answer in trials if answer.failed],
        "all_decisions": rate(is_right(*row) for row in of(*DECIDED)),
        **_singles(of("single")), **_alarms(of),
        "newcomer_named": _newcomers(of("single"), class_of), **_several(of("pair"), "pair", 2),
        **_several(of("triple"), "triple", 3),
        "set_coverage": rate(_set_covers(*row) for row in of(*DECIDED)),
        "set_coverage_all": rate(_set_covers(*row) for row in of(*DECIDED, *SEVERAL)),
        "set_size": estimate([answer.set_size for _, answer in of(*DECIDED)], np.mean),
        "calibration": calibration(of(*DECIDED)),
        "shrinkage": gap_reduction(of(*IN_LIBRARY)),
        "against_true_model": against_true_model(of(*IN_LIBRARY)),
        "seconds": summary(answer.seconds for _, _, answer in trials),
        "confusion": confusion(of(*DECIDED)),
        "wrong": [_error_row(*trial) for trial in trials if not leads(*trial[1:])],
        "vocabulary": sorted(FAMILY)}


def _singles(single: list[Row]) -> dict[str, Any]:
    right = [row for row in single if is_right(*row)]
    larger = [row for row in single if row[0]["severity"] != "mild"]
    mild = [row for row in single if row[0]["severity"] == "mild"]
    return {
        "top_1": rate(is_right(*row) for row in single),
        "top_1_medium_strong": rate(is_right(*row) for row in larger),
        "top_1_mild": rate(is_right(*row) for row in mild),
        "top_3": rate(label["labels"][0] in answer.order[:3] for label, answer in single),
        "family": rate(_family_right(*row) for row in single),
        "joint": rate(joints_right(*row) for row in right
                      if row[0]["effects"][0]["joints"] and row[1].decision not in NO_EFFECTS),
        "effect_and_joint": rate(is_right(*row) and joints_right(*row) for row in single),
        "by_size": _rates_by(single, lambda label: [label["severity"]]),
        "by_robot": _rates_by(single, lambda label: [label["robot"]]),
        "by_gear": _rates_by(single, _gear_class),
        "by_excitation": _rates_by(single, lambda label: label["excitations"][:2]),
        "by_effect": _rates_by(single, lambda label: label["names"])}


def _family_right(label: Label, answer: Answer) -> bool:
    family = FAMILY.get(answer.decision)
    return is_right(label, answer) or family is not None and family in {
        FAMILY.get(name) for name in label["names"]}


def _newcomers(single: list[Row], class_of: ClassOf) -> dict[str, Any]:
    """Return how often an effect of the standard study is called by a name that is not in it."""
    first = {class_of(name) for name in EFFECTS}
    return rate(not is_right(label, answer) and not answer.failed
                and answer.decision not in {*first, *NO_EFFECTS}
                for label, answer in single if label["names"][0] in EFFECTS)


def _alarms(of: Callable[..., list[Row]]) -> dict[str, Any]:
    harmless = ("none", "parametric")
    return {
        "false_alarm": rate(answer.decision not in harmless for _, answer in of("none")),
        "false_structure": rate(answer.decision not in harmless and not is_right(label, answer)
                                for label, answer in of("parametric")),
        "parametric_named": rate(is_right(*row) for row in of("parametric")),
        "unknown_detected": rate(is_right(*row) for row in of("unknown")),
        "unknown_called_none": rate(answer.decision == "none" for _, answer in of("unknown")),
        "false_unknown": rate(answer.decision == "unknown"
                              for _, answer in of("single", "none", "parametric"))}


def _several(rows: list[Row], kind: str, size: int) -> dict[str, Any]:
    return {
        f"{kind}_recall": rate(answer.probability.get(name, 0.0) >= 0.5
                               for label, answer in rows for name in label["labels"]),
        f"{kind}_all_in_top_{size}": rate(leads(*row) for row in rows),
        f"{kind}_top_1_is_one": rate(is_right(*row) for row in rows),
        f"{kind}_all_in_set_90": rate(_set_covers(*row) for row in rows)}


def _set_covers(label: Label, answer: Answer) -> bool:
    return truth_of(label) <= set(answer.set_90) or bool(
        effect_of_number(label) & set(answer.set_90))


def calibration(rows: list[Row]) -> dict[str, Any]:
    """Brier score, expected calibration error and reliability of the decisions."""
    points = [(answer.confidence, is_right(label, answer)) for label, answer in rows]
    bins = [min(int(stated * BINS), BINS - 1) for stated, _ in points]
    table = []
    for b in sorted(set(bins)):
        inside = [point for point, at in zip(points, bins) if at == b]
        table.append({"from": b / BINS, "to": (b + 1) / BINS,
                      "stated": float(np.mean([stated for stated, _ in inside])),
                      "observed": rate(right for _, right in inside)})
    return {"brier": estimate(points, brier),
            "ece": estimate(points, calibration_error), "reliability": table}


def gap_reduction(rows: list[Row]) -> dict[str, Any]:
    """Achieved over achievable reduction of the gap on the unseen log, and both for each trial."""
    points = [(label["gap"]["achievable_reduction"], 1 - answer.after / answer.before,
               leads(label, answer)) for label, answer in rows
              if answer.before and answer.after is not None]
    return {**summary(achieved / achievable for achievable, achieved, _ in points
                      if achievable > VISIBLE), "points": points}


def against_true_model(rows: list[Row]) -> dict[str, Any]:
    """Gap on the unseen log after a right diagnosis, over the gap that the true model leaves."""
    return summary(answer.after / label["gap"]["true_model"] for label, answer in rows
                   if answer.after is not None and leads(label, answer))


def confusion(rows: list[Row]) -> dict[str, dict[str, int]]:
    """Counts of decisions by truth."""
    counts: dict[str, Counter[str]] = {}
    for label, answer in rows:
        name = label["labels"][0] if label["kind"] == "single" else label["kind"]
        counts.setdefault(name, Counter())[answer.decision] += 1
    return {name: dict(decisions.most_common()) for name, decisions in sorted(counts.items())}


def _gear_class(label: Label) -> list[str]:
    """Class of the gear ratio, the median over the robot's joints."""
    if "gear_ratios" not in label:
        return []
    middle = float(np.median(label["gear_ratios"]))
    return [next(name for limit, name in GEARS if middle <= limit)]


def _rates_by(rows: list[Row], keys: Callable[[Label], Iterable[str]]) -> dict[str, Any]:
    groups: dict[str, list[bool]] = {}
    for label, answer in rows:
        for key in keys(label):
            groups.setdefault(key, []).append(is_right(label, answer))
    return {key: rate(flags) for key, flags in sorted(groups.items())}


def _error_row(name: str, label: Label, answer: Answer) -> dict[str, Any]:
    rank = [answer.order.index(true) + 1 if true in answer.order else None
            for true in sorted(truth_of(label))]
    return {"trial": name, "kind": label["kind"], "true": label["labels"],
            "said": answer.decision, "probability": answer.confidence,
            "top": answer.order[:3], "rank_of_truth": rank, "ratio": label["ratio"],
            "robot": label["robot"], "set_90": answer.set_90}
