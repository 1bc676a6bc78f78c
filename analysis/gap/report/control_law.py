"""What the check of the control law found, in words."""

from __future__ import annotations

from collections.abc import Sequence

from clie_blocks.analysis.gap.controller.terms import REMEDY, WEIGHT
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    Row,
    join_words,
    number,
    with_prefix,
)

MANY = 10  # times from which on whole ones are told


def law_lines(answer: Answer, names: Sequence[str]) -> list[str]:
    """How the law that ran differs from the stated one, one line each; names are of joints."""
    return [f"{sentence}." for sentence in answer.get("controller_differences", ())] + _left(
        answer.get("controller", ()), names)


def _left(rows: Sequence[Row], names: Sequence[str]) -> list[str]:
    """What the stated law leaves of the logged commands; as a list of one or none."""
    if not rows:
        return []
    left = [f"{with_prefix(row['error'], row['unit'])} RMS at {names[row['joint'] - 1]} "
            f"({_times(row)} times its rounding)" for row in rows]
    found = [f"it contains {join_words(_terms(row))} at {names[row['joint'] - 1]}"
             for row in rows if row["terms"]]
    missing = "" if len(found) == len(rows) else (
        "an excitation pe that was not logged, or a part of the law, is missing")
    remedy = REMEDY if any(WEIGHT in row["terms"] for row in rows) else ""
    return [f"The logged command is not that of the stated law, by {join_words(left)}: "
            f"{'; '.join(filter(None, [*found, missing, remedy]))}; {_driven_by(rows[0])}."]


def _times(row: Row) -> str:
    """How many times the rounding of a command is left."""
    times = row["error"] / row["limit"]
    return f"{times:,.0f}" if times >= MANY else number(times, 2)


def _terms(row: Row) -> list[str]:
    """Terms of a command that the stated law does not have."""
    if row["velocity_error"]:
        return ["Kd (dqd - dq) in the place of -Kd dq"]
    return [f"{number(entry['value'])} times the weight of the links" if name == WEIGHT
            else f"{name} {number(entry['value'])} {entry['unit']}"
            for name, entry in row["terms"].items()]


def _driven_by(row: Row) -> str:
    """What drives the models of a robot whose law is not the stated one."""
    if row["led"]:
        return "a model under that law diverges, so that an observer leads the models"
    return ("models follow the recorded command" if row["followed"] else
            "models follow the stated law, which the motion bears out")
