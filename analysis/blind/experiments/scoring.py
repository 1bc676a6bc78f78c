"""What recommended runs bring: how far the set shrinks, to which name, within which limits."""

from typing import Any

import numpy as np

from clie_blocks.analysis.blind.experiments.rounds import RUNS, is_ambiguous
from clie_blocks.analysis.blind.scoring.classes import ClassOf, as_classes, label_as_classes
from clie_blocks.analysis.blind.scoring.decisions import Answer, is_right, truth_of
from clie_blocks.analysis.blind.scoring.intervals import estimate, rate, share_text

SOUGHT_RUNS, SOUGHT_RIGHT = 2, 0.95
LIMITS = "position", "speed", "command"
Row = dict[str, Any]


def score(answers: dict[str, list[dict[str, Any]]], labels: dict[str, Any],
          class_of: ClassOf) -> dict[str, Any]:
    """Return the figures of a study, and a row per robot that was ambiguous.

    Parameters
    ----------
    answers : dict
        Rounds of `follow`, by trial.
    labels : dict
        Opened labels, by trial.
    class_of : callable
        Class of a name.

    """
    first = [_right(rounds[0], labels[name], class_of) for name, rounds in sorted(answers.items())]
    ambiguous = {name: rounds for name, rounds in sorted(answers.items())
                 if is_ambiguous(rounds[0])}
    return {"trials": len(answers), "right_at_once": rate(first),
            "ambiguous": rate(name in ambiguous for name in answers),
            **figures([_row(name, rounds, labels[name], class_of)
                       for name, rounds in ambiguous.items()])}


def figures(rows: list[Row]) -> dict[str, Any]:
    """Return the figures of some rows.

    Of the robots for which a run was recommended: ``runs`` to one name, counted as one more than
    the most where none was reached; ``sizes`` of the set after each run; and whether the right
    name leads ``before`` and ``after``.
    """
    ran = [row for row in rows if row["used"]]
    return {"followed": rate(bool(row["used"]) for row in rows),
            "runs": estimate([row["runs"] for row in ran], lambda some: float(np.median(some))),
            "reached": rate(row["runs"] <= RUNS for row in ran),
            "sizes": [estimate([row["sizes"][min(turn, len(row["sizes"]) - 1)] for row in ran],
                               lambda some: float(np.mean(some))) for turn in range(RUNS + 1)],
            "before": rate(row["right"][0] for row in ran),
            "after": rate(row["right"][-1] for row in ran),
            "right_of_reached": rate(row["right"][-1] for row in ran if row["runs"] <= RUNS),
            "in_set": rate(row["in_set"] for row in ran),
            "exceeded": rate(max(used) > 1.0 for row in ran for used in row["used"]),
            "largest": {name: max((used[k] for row in ran for used in row["used"]), default=None)
                        for k, name in enumerate(LIMITS)},
            "left": sum(row["left"] for row in rows), "rows": rows}


def _row(trial: str, rounds: list[dict[str, Any]], label: dict[str, Any], class_of: ClassOf,
         ) -> Row:
    answers = [Answer(as_classes(one, class_of)) for one in rounds if "error" not in one]
    truth = truth_of(label_as_classes(label, class_of))
    last = answers[-1]
    is_settled = "error" not in rounds[-1] and not is_ambiguous(rounds[-1])
    return {"trial": trial, "effect": label["labels"][0], "severity": label["severity"],
            "sizes": [one.set_size for one in answers],
            "sets": [one.set_90 for one in answers],
            "decisions": [one.decision for one in answers],
            "right": [_right(one, label, class_of) for one in rounds if "error" not in one],
            "in_set": any(last.names(name) & truth for name in last.set_90),
            "runs": len(rounds) - 1 if is_settled else RUNS + 1,
            "used": [one["used"] for one in rounds if one.get("used")],
            "left": any(one.get("left", False) for one in rounds)}


def _right(plain: dict[str, Any], label: dict[str, Any], class_of: ClassOf) -> bool:
    return "error" not in plain and is_right(
        label_as_classes(label, class_of), Answer(as_classes(plain, class_of)))


def is_missed(board: dict[str, Any]) -> bool:
    """Whether runs take more, or lead to the right name less often, than sought."""
    runs, right = board["runs"]["value"], board["right_of_reached"]["rate"]
    return bool((runs is not None and runs > SOUGHT_RUNS)
                or (right is not None and right < SOUGHT_RIGHT)
                or board["exceeded"]["hits"] or board["left"])


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    runs = board["runs"]
    sizes = ", ".join("-" if one["value"] is None else f"{one['value']:.2f}"
                      for one in board["sizes"])
    largest = ", ".join("-" if share is None else f"{name} {share:.2f}"
                        for name, share in board["largest"].items())
    return [board["command"],
            f"  ambiguous at first: {share_text(board['ambiguous'])}; a run was recommended for "
            f"{share_text(board['followed'])}",
            "  no run was recommended" if runs["value"] is None else
            f"  runs to one name, median: {runs['value']:g}, sought {SOUGHT_RUNS}; reached within "
            f"{RUNS}: {share_text(board['reached'])}",
            f"  classes in the 90 % set after 0 to {RUNS} runs, mean: {sizes}",
            f"  right first before: {share_text(board['before'])}, after: "
            f"{share_text(board['after'])}; where one name remains: "
            f"{share_text(board['right_of_reached'])}, sought {SOUGHT_RIGHT:g}",
            f"  90 % set holds the truth after: {share_text(board['in_set'])}",
            f"  runs beyond a stated limit: {share_text(board['exceeded'])}; largest share of a "
            f"limit: {largest}; runs that left the set-point: {board['left']}",
            *(f"  {row['trial']}: {row['effect']}, " + " -> ".join(
                f"{decision} of {size}" for decision, size in zip(row["decisions"], row["sizes"]))
              for row in board["rows"] if row["used"] and not row["right"][-1])]
