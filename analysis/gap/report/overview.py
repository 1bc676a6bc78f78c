"""The page of a set of robots: which have which cause, sorted by it, each with its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from clie_blocks.analysis.gap.report.cause_words import joint_names, leading_rows, together
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    effect_title,
    join_words,
    number,
    percent,
)
from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Link, Section, Table

HEALTHY, FAILED = "no gap", "not diagnosed"
VERDICTS = {"none": HEALTHY, "parametric": "numbers of the robot file",
            "unexplained": "not in the library", "not_identifiable": "not identifiable"}


def overview(answers: Mapping[str, Answer]) -> Document:
    """Arrange the answers of several robots, those with the same cause side by side.

    Parameters
    ----------
    answers : mapping of str to dict
        The JSON answers by name of the robot.

    """
    cause = {name: _cause(answer) for name, answer in answers.items()}
    count = Counter(cause.values())
    order = sorted(answers, key=lambda name: (cause[name] == FAILED, cause[name] == HEALTHY,
                                              -count[cause[name]], cause[name], name))
    table = Table(("robot", "cause", "joint", "probability", "gap removed"),
                  tuple(_row(name, answers[name], cause[name]) for name in order),
                  marks=tuple(_mark(cause[name]) for name in order))
    said = "; ".join(f"{robots} x {name}" for name, robots in count.most_common())
    return Document(f"{len(answers)} robots", f"Robots by cause: {said}.",
                    GOOD if set(count) == {HEALTHY} else UNSURE,
                    (Section("All robots", tables=(table,)),))


def _cause(answer: Answer) -> str:
    if "error" in answer:
        return FAILED
    if answer["verdict"] in VERDICTS:
        return VERDICTS[answer["verdict"]]
    return join_words(join_words(map(effect_title, (row["effect"], *row.get("alike", ()))), "or")
                      for row in leading_rows(answer))


def _row(name: str, answer: Answer, cause: str) -> tuple[str | Link, ...]:
    if "error" in answer:
        return name, cause, "-", "-", str(answer["error"])
    rows = leading_rows(answer) if answer["verdict"] == "effect" else []
    names, removed = joint_names(answer), answer["closed_percent"]["value"]
    joints = dict.fromkeys(names[k - 1] for row in rows for k in row["joint"] or ())
    return (Link(name, f"{name}.html"), cause, join_words(joints) or "-",
            join_words(percent(together(row)) for row in rows) or "-",
            f"{number(removed)} %" if rows and removed is not None else "-")


def _mark(cause: str) -> str:
    return {HEALTHY: GOOD, FAILED: BAD}.get(cause, UNSURE)
