"""Robots that their file does not describe: what a diagnosis reports on them.

The logs are true, but the file states something wrong about the controller, or cannot describe the
links.  A diagnosis may name what there is, or report that nothing it knows fits; it must not
attribute the gap to an effect that is not there.
"""

from typing import Any

from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate

NAMED, UNNAMED, MISSED, ACCUSED, FAILED = "named", "unknown", "missed", "accused", "failed"
SURELY = "accused_surely"
SURE = 0.5  # probability from which a false attribution would be acted upon
CONTROLLER = "velocity_filter_mismatch"  # the vocabulary's own word for a wrong description


def score_misdescribed(diagnoses: dict[str, dict[str, Any]],
                       labels: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the shares of all outcomes, over all robots and by what is hidden.

    Parameters
    ----------
    diagnoses : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial; ``present`` lists the names that are right.

    """
    rows = [_row(name, label, diagnoses[name]) for name, label in sorted(labels.items())]
    return {"trials": len(rows), **outcome_shares(rows), "rows": rows,
            "by_hidden": {name: outcome_shares([row for row in rows if row["hidden"] == name])
                          for name in dict.fromkeys(row["hidden"] for row in rows)}}


def _row(name: str, label: dict[str, Any], diagnosis: dict[str, Any]) -> dict[str, Any]:
    answer = Answer(diagnosis)
    return {"trial": name, "hidden": label["labels"][0], "how": label["wrong"],
            "robot": label["robot"], "said": answer.decision, "stated": answer.confidence,
            "outcome": outcome(diagnosis, label["present"])}


def outcome_shares(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Share of every outcome."""
    return {**{key: rate(row["outcome"] == key for row in rows)
               for key in (NAMED, UNNAMED, MISSED, ACCUSED, FAILED)},
            SURELY: rate(row["outcome"] == ACCUSED and row["stated"] >= SURE for row in rows)}


def outcome(diagnosis: dict[str, Any], present: list[str]) -> str:
    """One word for a diagnosis of a robot that its file does not describe.

    Parameters
    ----------
    diagnosis : dict
        JSON object.
    present : list of str
        Names that are right; if the controller is among them, a decision of the controller check,
        reported as a sentence, counts as naming it.

    """
    answer = Answer(diagnosis)
    if answer.failed:
        return FAILED
    if answer.decision not in (*NO_EFFECTS, *present):
        return ACCUSED
    if answer.decision in present or (CONTROLLER in present and diagnosis.get("decisions")):
        return NAMED
    return UNNAMED if answer.decision == "unknown" else MISSED
