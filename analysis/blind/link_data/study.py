"""The study of wrong and missing link data: made, sealed, diagnosed, unsealed, scored."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.link_data.robots import LINK_DATA
from clie_blocks.analysis.blind.protocol.study import run_sealed
from clie_blocks.analysis.blind.report.wording import percent
from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.scoring.intervals import rate
from clie_blocks.analysis.blind.scoring.robustness import NAMED, SURE, outcome

FALSELY = "named_falsely"  # names with half the probability, of effects that are not there


def run_study(folder: Path, count: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make, diagnose and open a study of some arms, or continue it, and return its figures."""
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    return {"seed": seed, **score(*run_sealed(folder, count, seed, jobs, LINK_DATA), class_of)}


def score(diagnoses: dict[str, dict[str, Any]], labels: dict[str, dict[str, Any]],
          class_of: Callable[[str], str]) -> dict[str, Any]:
    """Return the figures of all arms, and by what their files state.

    Parameters
    ----------
    diagnoses, labels : dict
        Answers and opened labels, by trial.
    class_of : callable
        Name that stands for effects that no log tells apart.

    """
    rows = [_row(name, labels[name], diagnoses[name], class_of) for name in sorted(labels)]
    return {"trials": len(rows), **figures(rows), "rows": rows, "by_hidden": {
        hidden: figures([row for row in rows if row["hidden"] == hidden])
        for hidden in dict.fromkeys(row["hidden"] for row in rows)}}


def figures(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Shares of arms with a false name, and of those with an effect that have its name."""
    return {FALSELY: rate(bool(row[FALSELY]) for row in rows),
            "effect_named": rate(row["outcome"] == NAMED and row["said"] in row["effects"]
                                 for row in rows if row["effects"])}


def _row(name: str, label: dict[str, Any], diagnosis: dict[str, Any],
         class_of: Callable[[str], str]) -> dict[str, Any]:
    answer = Answer(diagnosis)
    right = {class_of(one) for one in label["present"]}
    return {"trial": name, "hidden": label["labels"][0], "how": label["wrong"],
            "robot": label["robot"], "said": answer.decision, "stated": answer.confidence,
            "effects": [one for one in label["present"] if one not in NO_EFFECTS],
            "outcome": outcome(diagnosis, label["present"]),
            FALSELY: [one for one, probability in answer.probability.items()
                      if probability >= SURE and one not in NO_EFFECTS
                      and class_of(one) not in right]}


def is_missed(board: dict[str, Any]) -> bool:
    """Whether an effect that is not there was named with half the probability."""
    return bool(board[FALSELY]["hits"])


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Figures for a terminal, and each arm."""
    lines = [f"{board['command']}: an effect that is not there named with half the probability"]
    lines += [f"  {hidden}: {percent(shares[FALSELY])}; an effect that is there named first "
              f"{percent(shares['effect_named'])}"
              for hidden, shares in board["by_hidden"].items()]
    return [*lines, *(f"  {row['trial']}: {row['how']}; {', '.join(row['effects']) or 'sound'}: "
                      f"{row['said']} ({row['stated']:.2f})" for row in board["rows"])]
