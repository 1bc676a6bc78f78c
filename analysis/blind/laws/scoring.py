"""What a study of laws found: laws named, sound robots not accused, effects named as under PD."""

import re
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.laws.trials import RIGHT, TRIAL, TWIN
from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes, label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import FAMILY, NO_EFFECTS, Answer, is_right
from clie_blocks.analysis.blind.scoring.intervals import rate, share_difference, share_text

NAMED, ACCUSED, LOST = 0.95, 0.02, -0.04  # what is sought
SURE = 0.5  # probability from which a false name would be acted upon
WITHIN = 0.05  # relative error of a number of a law
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
OF_LAW = "controller"  # family of names that say what the commands show of the law


def score(answers: dict[str, Any], labels: dict[str, Any], class_of: ClassOf) -> dict[str, Any]:
    """Return the figures of a study, and a row per trial.

    Parameters
    ----------
    answers : dict
        JSON objects of the diagnosis, by trial and twin.
    labels : dict
        Opened labels, by trial.
    class_of : callable
        Class of a name.

    """
    rows = [_row(trial, labels[trial], answers, class_of) for trial in sorted(labels)]
    sound = [row for row in rows if row["effect"] == "none"]
    others = [row for row in rows if row["effect"] != "none"]
    return {
        "trials": len(rows),
        "law_named": rate(row["law_named"] for row in rows),
        "by_description": {word: rate(row["law_named"] for row in rows
                                      if row["described"] == word)
                           for word in dict.fromkeys(row["described"] for row in rows)},
        "by_law": {kind: rate(row["law_named"] for row in rows if row["law"] == kind)
                   for kind in dict.fromkeys(row["law"] for row in rows)},
        "accused": rate(row["accused"] for row in sound),
        "none_of_sound": rate(row["answer"] == "none" for row in sound),
        "right_first": rate(row["right"] for row in others),
        "right_first_of_twins": rate(row["twin_right"] for row in others),
        "beside_twins": share_difference([(row["right"], row["twin_right"]) for row in others]),
        "wrong_of_effects": rate(row["accused"] for row in others),
        "rows": rows}


def _row(trial: str, label: dict[str, Any], answers: dict[str, Any], class_of: ClassOf
         ) -> dict[str, Any]:
    truth = label_as_classes(label, class_of)
    answer = _robot_only(answers[trial], class_of)
    row = {"trial": trial, "law": label["law"], "described": label["described"],
           "effect": label["labels"][0], "law_named": is_law_named(label, answers[trial]),
           "answer": answer.decision, "probability": answer.confidence,
           "accused": is_accused(truth, answer), "right": is_right(truth, answer)}
    if label["kind"] == "none":
        return row
    twin = _robot_only(answers[trial.replace(TRIAL, TWIN)], class_of)
    return {**row, "twin_right": is_right(truth, twin), "answer_of_twin": twin.decision}


def _robot_only(diagnosis: dict[str, Any], class_of: ClassOf) -> Answer:
    """What is said of the robot: effects that the commands show of the law are said of the law."""
    effects = diagnosis.get("effects", [])
    robot = [row for row in effects if FAMILY.get(row["effect"]) != OF_LAW]
    whole = sum(row["probability"] for row in robot if row["effect"] in NO_EFFECTS)
    if len(robot) < len(effects) and not any(row["probability"] >= SURE for row in robot):
        robot = [*robot, {"effect": "none", "joint": None, "probability": 1.0 - whole}]
    kept = {**diagnosis, "effects": robot, "log": {}}
    return Answer(as_classes(kept, class_of) if effects else kept)


def is_accused(label: dict[str, Any], answer: Answer) -> bool:
    """Whether an effect that is not there has half the probability or more."""
    return any(name not in (*NO_EFFECTS, *label["labels"])
               and not answer.names(name) & set(label["labels"]) and probability >= SURE
               for name, probability in answer.probability.items())


def is_law_named(label: dict[str, Any], diagnosis: dict[str, Any]) -> bool:
    """Whether an answer accepts a law that is stated right, and else says which one ran.

    At every joint a sentence has to name it, with its numbers; or the effect was corrected in the
    logs.
    """
    if label["described"] == RIGHT:
        return bool(diagnosis.get("controller_as_stated")) and not diagnosis["laws"]
    corrected = {one.get("effect") for one in diagnosis.get("log", {}).get("corrections", ())}
    if corrected & set(label["words"]):
        return True
    sentences = [*diagnosis.get("controller_differences", ()), *diagnosis.get("decisions", ())]
    return all(any(_names(sentence, label, k) for sentence in sentences)
               for k in range(label["joints"]))


def _names(sentence: str, label: dict[str, Any], k: int) -> bool:
    """Whether a sentence names the law of a joint with the numbers that ran there."""
    found = [float(number) for number in NUMBER.findall(sentence)]
    return (sentence.startswith(f"joint{k + 1}: ")
            and any(word in sentence for word in label["words"])
            and all(np.isclose(found, values[k], rtol=WITHIN).any()
                    for values in label["numbers"].values()))


def is_missed(board: dict[str, Any]) -> bool:
    """Whether fewer laws are accepted or named than sought."""
    return bool(board["law_named"]["rate"] < NAMED)


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    beside = board["beside_twins"]
    low, high = beside["interval"] or (np.nan, np.nan)
    return [board["command"],
            f"  law accepted, or named with its numbers: {share_text(board['law_named'])}, sought "
            f"{NAMED:.0%}",
            *(f"    described {word}: {share_text(figure)}"
              for word, figure in board["by_description"].items()),
            f"  sound robots accused: {share_text(board['accused'])}, "
            f"sought at most {ACCUSED:.0%}",
            f"  sound robots called sound: {share_text(board['none_of_sound'])}",
            f"  right class first: {share_text(board['right_first'])}",
            f"  the same robots under PD as stated: {share_text(board['right_first_of_twins'])}",
            f"  difference: {100.0 * (beside['value'] or 0.0):+.0f} points ({100.0 * low:+.0f} "
            f"to {100.0 * high:+.0f}), sought at least {100.0 * LOST:+.0f}",
            "  another effect named with half the probability: "
            f"{share_text(board['wrong_of_effects'])}"]
