"""Answers on imperfect logs against the opened labels.

Each trial is a robot whose files were damaged in one way, or left as they are (`SOUND`); its twin
is the same robot with the files as they were.  The figures, exactly:

``wrong_name``
    Of all trials: the answer gives half the probability or more to an effect that is neither one
    of the robot's nor a name for the damage (`Damage.also_right`), nor said to be alike with one
    of these: names that the logs do not tell apart are one answer.  A trial that stopped with an
    error names nothing.
``wrong_name_on_twins``
    The same on the undamaged twins.
``wrong_family``
    Of all trials: a wrong name that is of no family of the robot's effects (`decisions.FAMILY`).
``false_alarm``
    Of the trials of robots without an effect (kinds ``none`` and ``parametric``): the verdict is
    ``effect``, unless the name that leads is one for the damage.
``named``
    Of the trials whose damage is of kind ``description``: the answer names it, see `names_fault`.
``named_on_twins``
    The same rule on the undamaged twins of these trials, where there is nothing to be named.
``harmless``
    Of the trials whose damage is of kind ``harmless``: share whose whole truth is ranked first
    (`decisions.leads`), less the same share of their twins.  An error is not right.
``fault_of_sound``
    Of the sound trials: stopped with an error, or with a correction of the log, or of the
    description where the robot's own parameters are not off (kind ``parametric``).
``broken``
    Of all trials: the command ended with another code than 0, 3, 4 or 5, or not at all.
``missed``
    Of the trials of robots with effects that did not stop: half the probability or more for
    ``none``.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, DESCRIPTION, HARMLESS, Damage
from clie_blocks.analysis.blind.imperfect.trials import SOUND
from clie_blocks.analysis.blind.protocol.targets import Target, compare
from clie_blocks.analysis.blind.scoring.classes import label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import (
    FAMILY,
    NO_EFFECTS,
    Answer,
    leads,
    truth_of,
)
from clie_blocks.analysis.blind.scoring.intervals import rate, share_difference

HALF = 0.5  # probability from which a name would be acted upon
BAD_DATA = (3, 4)  # exit codes whose message is an answer: bad data, not identifiable
EXPECTED = (0, 3, 4, 5)  # exit codes of a program that works
# keys of an answer that speak of the inputs
SPOKEN = ("log", "log_decisions", "controller", "decisions", "reason")
HEALTHY = ("none", "parametric")  # kinds of robot without an effect
TARGETS: tuple[Target, ...] = (
    ("wrong_name", "wrong name with half the probability or more", 0.02, False),
    ("false_alarm", "false alarm on a robot without an effect", 0.02, False),
    ("named", "fault of description or log named, of those that can be told", 0.90, True),
    ("harmless", "right class first where the damage is harmless, less the undamaged", -0.03,
     True))
Label = dict[str, Any]


def score_imperfect(answers: dict[str, dict[str, Any]], twins: dict[str, dict[str, Any]],
                    labels: dict[str, Label]) -> dict[str, Any]:
    """Score a study of imperfect logs.

    Parameters
    ----------
    answers, twins : dict
        JSON objects of the command on the trials and on their undamaged twins, by trial.
    labels : dict
        Opened labels of the robots, by trial, each with its damage under ``damage``.

    Returns
    -------
    dict
        The figures of this module with their intervals, the same by damage, and a row per trial.

    """
    rows = [_row(name, label_as_classes(label, str), answers[name], twins[name])
            for name, label in sorted(labels.items())]
    damages = dict.fromkeys([SOUND, *DAMAGES])
    groups = {name: [row for row in rows if row["damage"] == name] for name in damages}
    measured = figures(rows)
    return {"trials": len(rows), "targets": compare(measured, TARGETS), **measured, "rows": rows,
            "by_damage": {name: figures(group) for name, group in groups.items() if group}}


def figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of this module over some rows."""
    told = [row for row in rows if row["named"] is not None]
    sound = [row for row in rows if row["damage"] == SOUND]
    harmless = [row for row in rows if row["harmless"]]
    return {
        "of": len(rows),
        "wrong_name": rate(bool(row["wrong"]) for row in rows),
        "wrong_name_on_twins": rate(bool(row["twin_wrong"]) for row in rows),
        "wrong_family": rate(row["wrong_family"] for row in rows),
        "false_alarm": rate(row["alarm"] for row in rows if row["kind"] in HEALTHY),
        "named": rate(row["named"] for row in told),
        "named_on_twins": rate(row["named_on_twin"] for row in told),
        "harmless": share_difference([(row["right"], row["twin_right"]) for row in harmless]),
        "fault_of_sound": rate(row["faulted"] for row in sound),
        "broken": rate(row["broken"] for row in rows),
        "missed": rate(row["missed"] for row in rows if row["missed"] is not None),
        "stopped": rate(row["stopped"] for row in rows),
        "right": rate(row["right"] for row in rows),
        "twin_right": rate(row["twin_right"] for row in rows)}


def _row(name: str, label: Label, diagnosis: dict[str, Any], twin: dict[str, Any]
         ) -> dict[str, Any]:
    answer, damage = Answer(diagnosis), DAMAGES.get(label["damage"]["damage"])
    allowed = damage.also_right if damage else ()
    wrong = wrong_names(label, diagnosis, allowed)
    alarm = (label["kind"] in HEALTHY and diagnosis.get("verdict") == "effect"
             and not {*answer.known[:1]} & {*allowed})
    families = {FAMILY.get(name) for name in label["labels"]}
    return {
        "trial": name, "damage": label["damage"]["damage"],
        "chosen": {key: value for key, value in label["damage"].items() if key != "damage"},
        "robot": label["robot"], "kind": label["kind"], "true": label["labels"],
        "ratio": label["ratio"], "said": answer.decision, "probability": answer.confidence,
        "verdict": diagnosis.get("verdict"), "error": diagnosis.get("error"),
        "wrong": wrong, "twin_wrong": wrong_names(label, twin),
        "wrong_family": any(FAMILY.get(name) not in families for name in wrong),
        "alarm": alarm, "harmless": damage is not None and damage.kind == HARMLESS,
        "named": _named(damage, label, diagnosis), "named_on_twin": _named(damage, label, twin),
        "right": leads(label, answer), "twin_right": leads(label, Answer(twin)),
        "twin_said": Answer(twin).decision, "stopped": answer.failed,
        "faulted": answer.failed or _corrects(diagnosis, label["kind"]),
        "broken": diagnosis.get("exit_code", 0) not in EXPECTED,
        "missed": None if label["kind"] in HEALTHY or answer.failed
        else answer.probability.get("none", 0.0) >= HALF}


def wrong_names(label: Label, diagnosis: dict[str, Any], allowed: Sequence[str] = ()
                ) -> dict[str, float]:
    """Effects that have half the probability or more and are neither the truth nor allowed."""
    answer, right = Answer(diagnosis), {*truth_of(label), *allowed}
    return {name: probability for name, probability in answer.probability.items()
            if probability >= HALF and name not in NO_EFFECTS and not answer.names(name) & right}


def _named(damage: Damage | None, label: Label, diagnosis: dict[str, Any]) -> bool | None:
    """Whether an answer names the damage; None where there is nothing to be named."""
    if damage is None or damage.kind != DESCRIPTION:
        return None
    return names_fault(damage, label["damage"], diagnosis)


def names_fault(damage: Damage, chosen: dict[str, Any], diagnosis: dict[str, Any]) -> bool:
    """Whether an answer names a damage of the description or the log.

    It does if one sentence that speaks of the inputs contains its words: a correction, a warning
    or a reading of the log, the finding on the controller, the reason of the verdict, or the
    message of an error of exit code 3 or 4; or if ``description`` corrects its key of the robot
    file, at the joint that was damaged; or if the decision is a name for it
    (`Damage.also_right`).

    Parameters
    ----------
    damage : Damage
        The damage.
    chosen : dict
        What it chose; ``joint`` is the joint that was damaged, if there is one.
    diagnosis : dict
        JSON object of the command.

    """
    words = re.compile(damage.words, re.IGNORECASE | re.DOTALL)
    if any(words.search(sentence) for sentence in _sentences(diagnosis)):
        return True
    if any(row.get("key") in damage.keys and row.get("joint") in (None, chosen.get("joint"))
           for row in diagnosis.get("description") or ()):
        return True
    return Answer(diagnosis).decision in damage.also_right


def _sentences(diagnosis: dict[str, Any]) -> Iterator[str]:
    """Sentences of an answer that speak of log, description or controller."""
    if diagnosis.get("exit_code") in BAD_DATA:
        yield str(diagnosis["error"])
    for key in SPOKEN:
        yield from _entries(diagnosis.get(key))


def _entries(value: Any) -> Iterator[str]:
    """Texts within a value; the texts of one entry with named parts make one sentence."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield " ".join(part for part in value.values() if isinstance(part, str))
        for part in value.values():
            if not isinstance(part, str):
                yield from _entries(part)
    elif isinstance(value, list):
        for part in value:
            yield from _entries(part)


def _corrects(diagnosis: dict[str, Any], kind: str) -> bool:
    """Whether an answer corrects a sound log, or a description that is right."""
    if (diagnosis.get("log") or {}).get("corrections"):
        return True
    return bool(diagnosis.get("description")) and kind != "parametric"
