"""The study of exported corrections: sealed trials of one joint, diagnosed, exported, replayed."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.exported.measure import measure
from clie_blocks.analysis.blind.population.one_joint import ONE_JOINT
from clie_blocks.analysis.blind.protocol import study
from clie_blocks.analysis.blind.scoring.decisions import Answer, leads
from clie_blocks.analysis.blind.scoring.intervals import estimate, summary
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

MEASURED = "measured"  # folder of the rows of a study
LARGEST_RATIO, COVERAGE, WITHIN = 1.1, 0.90, 0.03


def run_study(folder: Path, trials: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make, diagnose and open trials, then export each right diagnosis and replay it.

    Parameters
    ----------
    folder : Path
        Of the study; one that is there is continued.
    trials : int
        How many; the effects come in turn.
    seed : int
        Of the random numbers.
    jobs : int
        Trials diagnosed in parallel.

    """
    answers, labels = study.run_sealed(folder, trials, seed, jobs, ONE_JOINT)
    rows = []
    with progress("exporting and replaying", trials) as advance:
        for name in sorted(labels):
            rows.append({"trial": name, "effect": labels[name]["labels"][0],
                         **_kept_row(folder, name, answers[name], labels[name])})
            advance(1)
    return {"seed": seed, **score(rows), "trials": rows}


def _kept_row(folder: Path, name: str, answer: dict[str, Any],
              label: dict[str, Any]) -> dict[str, Any]:
    """Row of a trial, from the disk where a run that was stopped has left it."""
    kept = folder / MEASURED / f"{name}.json"
    if not kept.is_file():
        write(kept, to_json(_row(folder / study.TRIALS / name, answer, label)))
    row: dict[str, Any] = json.loads(kept.read_text())
    return row


def _row(trial: Path, answer: dict[str, Any], label: dict[str, Any]) -> dict[str, Any]:
    if "error" in answer or not leads(label, Answer(answer)):
        return {"right": False}
    floor = label["gap"]["replayed_truth"]
    try:
        found = measure(trial, answer)
    except ClieError as error:
        return {"right": True, "refused": str(error)}
    return {"right": True, "ratio": found["gap"] / floor,
            "package_ratio": answer["gap_after"] / floor, **found}


def score(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the median ratio of the gaps in MuJoCo, and the mean share within the band."""
    shares = [row["coverage"] for row in rows if row.get("coverage") is not None]
    return {"ratio": summary(row.get("ratio") for row in rows),
            "package_ratio": summary(row.get("package_ratio") for row in rows),
            "coverage": estimate(shares, np.mean),
            "right": sum(row["right"] for row in rows),
            "refused": [row["trial"] for row in rows if "refused" in row]}


def is_missed(board: dict[str, Any]) -> bool:
    """Whether exported corrections leave more than sought."""
    median = board["ratio"]["median"]
    return median is not None and bool(median > LARGEST_RATIO)


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    def said(figure: dict[str, Any], value: str) -> str:
        if figure[value] is None:
            return "none"
        low, high = figure["interval"]
        return f"{figure[value]:.3f} ({low:.3f} to {high:.3f}) of {figure['of']}"

    return [f"{board['command']}: {board['right']} of {len(board['trials'])} diagnosed right",
            "  gap in MuJoCo over that of the true model, median: "
            f"{said(board['ratio'], 'median')}, sought {LARGEST_RATIO:g} or less",
            f"  the same of the package's own model: {said(board['package_ratio'], 'median')}",
            f"  unseen motion within the nominal 90 % band, mean: "
            f"{said(board['coverage'], 'value')}, sought {COVERAGE:g} +- {WITHIN:g}",
            *(f"  {row['trial']}: {row['effect']}, " + _told(row) for row in board["trials"])]


def _told(row: dict[str, Any]) -> str:
    if "refused" in row:
        return f"not exported: {row['refused']}"
    if not row["right"]:
        return "not diagnosed right"
    band = "" if row["coverage"] is None else f", {row['coverage']:.3f} within the band"
    return f"{row['ratio']:.3f}{', module' if row['module'] else ''}{band}"
