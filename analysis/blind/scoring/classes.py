"""Names that no log tells apart count as one class: any of them is right where another is true."""

from collections.abc import Callable
from typing import Any

from clie_blocks.analysis.blind.population.outsiders import known_as
from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS

ClassOf = Callable[[str], str]


def as_classes(diagnosis: dict[str, Any], class_of: ClassOf) -> dict[str, Any]:
    """Return a diagnosis in classes: members share one probability, and the joint of the first.

    An effect of the catalogue that was proven and corrected in the logs is an answer, too.
    """
    merged: dict[str, dict[str, Any]] = {}
    proven = [{"effect": one["effect"], "joint": one["joint"], "probability": 1.0}
              for one in diagnosis.get("log", {}).get("corrections", []) if one.get("effect")]
    for row in (*proven, *diagnosis.get("effects", [])):
        name = _class(row["effect"], class_of)
        before = merged.get(name)
        alike = {*map(class_of, row.get("alike", ()))} - {name}
        merged[name] = {**row, "effect": name, "alike": sorted(alike)} if before is None else {
            **before, "probability": before["probability"] + row["probability"]}
    named = [_class(name, class_of) for name in (
        *(one["effect"] for one in proven), *diagnosis.get("set_90", []))]
    held = {"effects": [*merged.values()], "set_90": [*dict.fromkeys(named)]}
    return {**diagnosis, **{key: value for key, value in held.items() if key in diagnosis}}


def label_as_classes(label: dict[str, Any], class_of: ClassOf) -> dict[str, Any]:
    """Return a label in classes, and its names as they were under ``names``.

    What was outside the library when the trial was drawn is an effect of it by now, if the
    catalogue holds it.
    """
    (name, *_), robot = label["labels"], label.get("robot", "")
    known = known_as(name, robot) if label["kind"] == "unknown" else None
    if known:
        label = {**label, "kind": "single", "labels": [known],
                 "effects": [{**one, "effect": known} for one in label["effects"]]}
    return {**label, "names": label["labels"],
            "labels": [_class(name, class_of) for name in label["labels"]],
            "effects": [{**one, "effect": _class(one["effect"], class_of)}
                        for one in label.get("effects", [])]}


def _class(name: str, class_of: ClassOf) -> str:
    return name if name in NO_EFFECTS else class_of(name)
