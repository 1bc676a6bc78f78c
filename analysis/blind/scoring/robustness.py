"""Robots that their file does not describe: what a diagnosis says of them.

The logs are true, but the file says something wrong of the controller, or has no words for the
links.  A diagnosis may name what there is, or say that nothing it knows fits; it must accuse
nothing that is not there.
"""

from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate

NAMED, UNNAMED, MISSED, ACCUSED, FAILED = "named", "unknown", "missed", "accused", "failed"
SURELY = "accused_surely"
SURE = 0.5  # probability from which an accusation would be acted upon
CONTROLLER = "velocity_filter_mismatch"  # the vocabulary's own word for a wrong description


def scored(diagnoses, labels):
    """Say what is said of these robots.

    Parameters
    ----------
    diagnoses : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial; ``present`` lists the names that are right.

    Returns
    -------
    dict
        Shares named, called unknown, missed, accused of an effect that is not there, and failed;
        the same by what is hidden.

    """
    rows = [_row(name, label, diagnoses[name]) for name, label in sorted(labels.items())]
    return {"trials": len(rows), **shares(rows), "rows": rows,
            "by_hidden": {name: shares([row for row in rows if row["hidden"] == name])
                          for name in dict.fromkeys(row["hidden"] for row in rows)}}


def _row(name, label, diagnosis):
    answer = Answer(diagnosis)
    return {"trial": name, "hidden": label["labels"][0], "how": label["wrong"],
            "robot": label["robot"], "said": answer.decision, "stated": answer.confidence,
            "outcome": outcome(diagnosis, label["present"])}


def shares(rows):
    """Share of every outcome."""
    return {**{key: rate(row["outcome"] == key for row in rows)
               for key in (NAMED, UNNAMED, MISSED, ACCUSED, FAILED)},
            SURELY: rate(row["outcome"] == ACCUSED and row["stated"] >= SURE for row in rows)}


def outcome(diagnosis, present):
    """One word for a diagnosis of a robot that its file does not describe.

    Parameters
    ----------
    diagnosis : dict
        JSON object.
    present : list of str
        Names that are right; where the controller is among them, a decision of the controller
        check, told in words, names it too.

    """
    answer = Answer(diagnosis)
    if answer.failed:
        return FAILED
    if answer.decision not in (*NO_EFFECTS, *present):
        return ACCUSED
    if answer.decision in present or (CONTROLLER in present and diagnosis.get("decisions")):
        return NAMED
    return UNNAMED if answer.decision == "unknown" else MISSED
