"""Causes of an answer in words: with their joints, families and probabilities."""

from __future__ import annotations

from collections.abc import Iterable

from clie_blocks.analysis.gap.report.wording import (
    Answer,
    Row,
    effect_title,
    join_words,
    percent,
)
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    NONE,
    PARAMETRIC,
    UNKNOWN,
)
from clie_blocks.effects import LIBRARY

OF_FAMILY = {"friction": "friction of some kind", "load": "a load of some kind",
             "environment": "an external disturbance"}
SURE = 0.9  # probability from which on the family of an effect adds nothing
MENTIONED = 0.02  # probability of a cause whose confounder is reported


def joint_names(answer: Answer) -> list[str]:
    """Names of the joints; 'joint 1' and so on where the answer holds none."""
    rows = answer.get("where", {}).get("joint", ())
    return [row["name"] for row in rows] or [
        f"joint {k + 1}" for k in range(max(_joint_count(answer), 1))]


def _joint_count(answer: Answer) -> int:
    named = [k for row in answer.get("effects", ()) for k in row["joint"] or ()]
    return max([len(answer.get("noise", ())), *named], default=0)


def leading_rows(answer: Answer) -> list[Row]:
    """Rows of the causes that are likely, or of the most likely one alone."""
    rows = [row for row in answer["effects"] if row["effect"] not in (NONE, UNKNOWN, PARAMETRIC)]
    likely: list[Row] = []
    for row in rows:
        stands_for = {*row.get("alike", ()), row["effect"]}
        if (together(row) >= LIKELY
                and not stands_for & {leading["effect"] for leading in likely}):
            likely.append(row)
    return likely or rows[:1]


def together(row: Row) -> float:
    """Probability of an effect or of one that the logs do not tell from it."""
    return float(row.get("together", row["probability"]))


def listed_causes(rows: Iterable[Row], answer: Answer) -> str:
    """Causes with joints and probabilities, largest share first, as a list of a sentence."""
    return join_words(_listed(row, answer) for row in sorted(rows, key=_largest_first))


def _largest_first(row: Row) -> float:
    """What a cause takes of the gap, largest first; nothing where it stands alone."""
    return -float(row["share"]["mean"]) if row.get("share") else 0.0


def _listed(row: Row, answer: Answer) -> str:
    """An effect, its joints and its probability; and what these logs do not tell it from."""
    alike = row.get("alike", ())
    if alike:
        return (f"{join_words([cause_at_joints(row, answer), *map(effect_title, alike)], 'or')} "
                f"({percent(together(row))}; these logs do not tell them apart)")
    return (f"{cause_at_joints(row, answer)} ({percent(row['probability'])}"
            f"{_family_clause(answer, row)})")


def cause_at_joints(row: Row, answer: Answer) -> str:
    """An effect and its joints; without joints where it is one of the whole robot."""
    names = joint_names(answer)
    joints = join_words(names[k - 1] for k in row["joint"] or ())
    return effect_title(row["effect"]) + (f" at {joints}" if joints else "")


def _family_clause(answer: Answer, row: Row) -> str:
    """How sure the family of an effect is, where the effect itself is not."""
    family = family_probability(answer, row)
    return f"; {family[0]} {percent(family[1])}" if family else ""


def candidates(answer: Answer) -> str:
    """What is left where no effect is likely: the family that is, or all names."""
    leading = leading_rows(answer)
    if leading and leading[0].get("alike"):
        return listed_causes(leading[:1], answer)
    likely = likely_family(answer, LIKELY)
    if not likely:
        return join_words(map(effect_title, answer["set_90"]), "or")
    family, probability, row = likely
    return (f"{family_title(family)} ({percent(probability)}), most likely "
            f"{cause_at_joints(row, answer)} ({percent(row['probability'])})")


def confounded(answer: Answer) -> list[Row]:
    """Rows of the causes that a confounder outside the library would explain as well."""
    return [row for row in answer["effects"]
            if row.get("rival") and row["probability"] >= MENTIONED]


def family_title(family: str) -> str:
    """A family of effects for a reader, where it is not known which of them it is."""
    return OF_FAMILY.get(family, f"a {family} effect")


def likely_family(answer: Answer, least: float) -> tuple[str, float, Row] | None:
    """Most likely family, its probability and the row of its most likely effect.

    None where no family has the probability `least`, or an effect of another family is as likely.
    """
    first, rows = _first_family(answer, least), _of_library(answer)
    return first if first and first[2] is rows[0] else None


def _first_family(answer: Answer, least: float) -> tuple[str, float, Row] | None:
    family, probability = next(iter(answer.get("families", {}).items()), ("", 0.0))
    if probability < least:
        return None
    return family, probability, next(row for row in _of_library(answer)
                                     if LIBRARY[row["effect"]].family == family)


def _of_library(answer: Answer) -> list[Row]:
    return [row for row in answer["effects"] if row["effect"] in LIBRARY]


def family_probability(answer: Answer, row: Row) -> tuple[str, float] | None:
    """Title and probability of an effect's family, where that is sure and the effect is not."""
    likely = _first_family(answer, SURE)
    if likely is None or likely[2] is not row or row["probability"] >= SURE:
        return None
    return family_title(likely[0]), likely[1]
