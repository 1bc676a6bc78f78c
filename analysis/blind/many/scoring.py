"""Robots with several effects at once: which are named, in which order, and what that closes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes
from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate, share_text, summary

NAMED = 0.5  # probability from which on a cause is named
SEEN = 0.05  # share of the excess from which on a cause should be named
PRECISION, RECALL, ORDER, CLOSED = 0.95, 0.85, 0.9, 0.9  # what is sought


def score(answers: dict[str, Any], labels: dict[str, Any], class_of: ClassOf) -> dict[str, Any]:
    """Return the figures of a study of robots with several effects, and a row per trial.

    Parameters
    ----------
    answers, labels : dict
        JSON objects of the diagnosis, and opened labels, by trial.
    class_of : callable
        Class of a name.

    """
    return figures([_row(trial, labels[trial], answers[trial], class_of)
                    for trial in sorted(labels)])


def figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of some rows, and the rows."""
    return {
        "trials": len(rows),
        "failed": [row["trial"] for row in rows if row["failed"]],
        "precision": rate(one["true"] for row in rows for one in row["named"]),
        "recall": rate(one["named"] for row in rows for one in row["truth"]
                       if one["share"] >= SEEN),
        "recall_by_rank": [rate(one["named"] for row in rows for one in row["truth"][k:k + 1]
                                if one["share"] >= SEEN) for k in range(3)],
        "order": rate(row["order"] for row in rows if row["order"] is not None),
        "largest_first": rate(row["largest_first"] for row in rows),
        "something_more": rate(row["unexplained"] for row in rows),
        "closed": summary(row["closed"] for row in rows),
        "rows": rows}


def _row(trial: str, label: dict[str, Any], diagnosis: dict[str, Any], class_of: ClassOf,
         ) -> dict[str, Any]:
    answer = Answer(as_classes(diagnosis, class_of) if "effects" in diagnosis else diagnosis)
    shares: dict[str, float] = {}
    for name, share in label["shares"].items():
        shares[class_of(name)] = shares.get(class_of(name), 0.0) + share
    together = {row["effect"]: row.get("together", row["probability"])
                for row in diagnosis.get("effects", ())}
    likely = {class_of(name) for name in together if together[name] >= NAMED}
    named = [name for name in answer.leading(len(answer.known)) if answer.names(name) & likely]
    held = _simpler_causes(diagnosis, class_of)
    stands_for = {true: next((name for names in (answer.names, held) for name in named
                              if true in names(name)), true) for true in shares}
    largest = sorted(shares, key=lambda name: -shares[name])
    by_share = sorted(named, key=lambda name: -_share(diagnosis, name, class_of))
    wanted = list(dict.fromkeys(stands_for[true] for true in largest))
    return {"trial": trial, "robot": label["robot"], "failed": answer.failed,
            "truth": [{"effect": name, "share": shares[name], "named": stands_for[name] in named}
                      for name in largest],
            "named": [{"effect": name, "probability": answer.probability[name],
                       "true": bool(answer.names(name) & set(shares))} for name in by_share],
            "largest_first": by_share[:1] == wanted[:1],
            "order": by_share[:2] == wanted[:2] if len(by_share) > 1 else None,
            "unexplained": bool(diagnosis.get("unexplained")),
            "closed": _closed(label, answer)}


def _simpler_causes(diagnosis: dict[str, Any], class_of: ClassOf) -> Callable[[str], set[str]]:
    """Function from a name to the simpler cause that it contains, where that takes a share.

    Friction that varies over the position is Coulomb friction as well: no log holds two levels.
    """
    held: dict[str, set[str]] = {}
    for row in diagnosis.get("effects", ()):
        share = row.get("share") or {}
        if share.get("simpler") and share["as_simpler"] >= SEEN:
            held.setdefault(class_of(row["effect"]), set()).add(class_of(share["simpler"]))
    return lambda name: held.get(name, set())


def _share(diagnosis: dict[str, Any], name: str, class_of: ClassOf) -> float:
    """What the gap loses without a cause, by an answer; its probability where none has a share."""
    effects = [row for row in diagnosis["effects"] if row["effect"] not in NO_EFFECTS]
    has_shares = any("share" in row for row in effects)
    rows = [row for row in effects if class_of(row["effect"]) == name]
    return float(max((row["share"]["last"] if "share" in row else
                      0.0 if has_shares else row["probability"] for row in rows), default=0.0))


def _closed(label: dict[str, Any], answer: Answer) -> float | None:
    """Closed share of the gap that the true model would close, on the unseen log."""
    if not answer.before or answer.after is None:
        return None
    least = label["gap"]["true_model"]
    reducible = answer.before**2 - least**2
    return float((answer.before**2 - answer.after**2) / reducible) if reducible > 0 else None


def is_missed(board: dict[str, Any]) -> bool:
    """Whether more causes are named that are not there than sought."""
    precision = board["precision"]["rate"]
    return precision is not None and bool(precision < PRECISION)


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    median = board["closed"]["median"]
    ranks = ", ".join(share_text(figure) for figure in board["recall_by_rank"])
    return [board["command"],
            f"  causes named with half the probability that are there: "
            f"{share_text(board['precision'])}, sought {PRECISION:.0%}",
            f"  causes with {SEEN:.0%} of the gap or more that are named: "
            f"{share_text(board['recall'])}, sought {RECALL:.0%}",
            f"    largest, second, third: {ranks}",
            f"  largest cause first: {share_text(board['largest_first'])}",
            f"  two largest in order, where two are named: {share_text(board['order'])}, sought "
            f"{ORDER:.0%}",
            f"  answers that hold something without a name: {share_text(board['something_more'])}",
            "  closed of the squared gap that the true model closes, median: "
            f"{np.nan if median is None else median:.2f}, sought {CLOSED:.2f}"]
