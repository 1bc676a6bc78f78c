"""What every single name of a study was taken for."""

from collections import Counter
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes, label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import SEVERAL, Answer, is_right
from clie_blocks.analysis.blind.scoring.intervals import rate


def score_by_name(diagnoses: dict[str, dict[str, Any]], labels: dict[str, dict[str, Any]],
                  class_of: ClassOf = str) -> dict[str, dict[str, Any]]:
    """Return, by name, class, kind, share right, mean size of the 90 % set and wrong answers.

    Parameters
    ----------
    diagnoses, labels : dict
        As in `score.score`.
    class_of : callable, optional
        Class of a name.

    """
    groups: dict[str, list[tuple[dict[str, Any], Answer]]] = {}
    for trial, label in sorted(labels.items()):
        if label["kind"] not in SEVERAL:
            answer = Answer(as_classes(diagnoses[trial], class_of))
            groups.setdefault(label["labels"][0], []).append(
                (label_as_classes(label, class_of), answer))
    return {name: _row(rows) for name, rows in sorted(
        groups.items(), key=lambda group: (group[1][0][0]["kind"], group[0]))}


def _row(rows: list[tuple[dict[str, Any], Answer]]) -> dict[str, Any]:
    first = rows[0][0]
    wrong = Counter(answer.decision for label, answer in rows if not is_right(label, answer))
    return {"class": first["labels"][0] if first["kind"] == "single" else first["kind"],
            "kind": first["kind"], "right": rate(is_right(*row) for row in rows),
            "set_size": float(np.mean([answer.set_size for _, answer in rows])),
            "wrong": dict(wrong.most_common())}
