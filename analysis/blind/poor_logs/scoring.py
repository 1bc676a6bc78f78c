"""What a study of poorer logs found: false names, sets that hold the truth, by kind of log."""

from collections.abc import Iterator
from typing import Any

from clie_blocks.analysis.blind.laws.scoring import is_accused
from clie_blocks.analysis.blind.poor_logs.kinds import CONDITIONS, CONTENTS
from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes, label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import Answer, is_right
from clie_blocks.analysis.blind.scoring.intervals import rate, share_text

WRONG, COVERED = 0.03, 0.93  # what is sought, at most and at least
COARSE_ENCODER = "encoder_quantization"  # what a logger does that rounds positions unasked
LATE_CHANNEL = "channel_skew"  # what the low-pass of a logger does to one of its channels
Row = dict[str, Any]


def score(answers: dict[str, Any], labels: dict[str, Any], class_of: ClassOf) -> dict[str, Any]:
    """Return the figures of a study, also by content and by condition, and a row per trial.

    Parameters
    ----------
    answers : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial.
    class_of : callable
        Class of a name.

    """
    rows = [_row(trial, label, answers[trial], class_of)
            for trial, label in sorted(labels.items())]
    return {"trials": len(rows), **figures(rows), **{
        f"by_{kind}": {name: figures([row for row in rows if row[kind] == name])
                       for name in dict.fromkeys(row[kind] for row in rows)}
        for kind in ("content", "condition")}, "rows": rows}


def figures(rows: list[Row]) -> dict[str, Any]:
    """Return the figures of some rows.

    ``wrong``: an effect that is not there has half the probability or more; ``covered``: the 90 %
    set holds the truth; ``right_first``, ``unknown`` and ``stopped``, with an error in the place
    of an answer, which covers nothing: what is put forward.
    """
    return {name: rate(row[name] for row in rows)
            for name in ("wrong", "covered", "right_first", "unknown", "stopped")}


def _row(trial: str, label: dict[str, Any], diagnosis: dict[str, Any], class_of: ClassOf) -> Row:
    truth = label_as_classes(label, class_of)
    for name in _names_of_logger(label):
        diagnosis = _without(name, diagnosis)
    answer = Answer(diagnosis if "error" in diagnosis else as_classes(diagnosis, class_of))
    return {"trial": trial, "content": label["content"], "condition": label["condition"],
            "effect": label["labels"][0], "answer": answer.decision,
            "probability": answer.confidence, "set_90": answer.set_90,
            "error": diagnosis.get("error"), "wrong": is_accused(truth, answer),
            "covered": any(answer.names(name) & set(truth["labels"]) for name in answer.set_90),
            "right_first": is_right(truth, answer), "unknown": answer.decision == "unknown",
            "stopped": answer.failed}


def _names_of_logger(label: dict[str, Any]) -> Iterator[str]:
    """Effects that the logger has, which its robot file does not state."""
    content, condition = CONTENTS[label["content"]], CONDITIONS[label["condition"]]
    if condition.is_coarse and not content.has_torque:
        yield COARSE_ENCODER
    if condition.is_filtered and content.measured:
        yield LATE_CHANNEL


def _without(name: str, diagnosis: dict[str, Any]) -> dict[str, Any]:
    """An answer without an effect that is there, but is not what is asked for.

    What named nothing else finds the robot sound.
    """
    if "error" in diagnosis:
        return diagnosis
    log = diagnosis.get("log", {})
    kept = [one for one in log.get("corrections", ()) if one.get("effect") != name]
    left = [one for one in diagnosis.get("set_90", ()) if one != name]
    return {**diagnosis, "log": {**log, "corrections": kept}, "set_90": left or ["none"],
            "effects": [row for row in diagnosis.get("effects", ()) if row["effect"] != name]}


def is_missed(board: dict[str, Any]) -> bool:
    """Whether more answers have a wrong name than sought."""
    return bool(board["wrong"]["rate"] > WRONG)


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    lines = [board["command"],
             f"  wrong name with half the probability: {share_text(board['wrong'])}, "
             f"sought at most {WRONG:.0%}",
             f"  90 % set holds the truth: {share_text(board['covered'])}, sought {COVERED:.0%}",
             f"  right class first: {share_text(board['right_first'])}",
             f"  unknown: {share_text(board['unknown'])}",
             f"  stopped with an error: {share_text(board['stopped'])}",
             f"  {'logs':22}{'robots':>7}{'wrong':>7}{'in set':>7}{'first':>7}{'unknown':>8}"
             f"{'stopped':>8}"]
    for kind in ("by_content", "by_condition"):
        lines += [f"  {name.replace('_', ' '):22}{row['wrong']['of']:7}{row['wrong']['hits']:7}"
                  f"{row['covered']['hits']:7}{row['right_first']['hits']:7}"
                  f"{row['unknown']['hits']:8}{row['stopped']['hits']:8}"
                  for name, row in board[kind].items()]
    return lines + [f"  {row['trial']}: {row['effect']} ({row['content']}, {row['condition']}), "
                    f"named {row['answer']}" for row in board["rows"] if row["wrong"]]
