"""The study of simulator faults: made, sealed, examined, unsealed, scored."""

from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.analysis.blind.scoring.intervals import rate, share_text
from clie_blocks.analysis.blind.simulator_faults.injected import INJECTED, NONE
from clie_blocks.analysis.blind.simulator_faults.trials import MODEL, write_trial
from clie_blocks.errors import ClieError
from clie_blocks.output import json_types, progress

TARGET = 0.9  # of the faults, named first


def run_study(folder: Path, laps: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make, examine and open a study, and return its figures.

    Parameters
    ----------
    folder : Path
        Of the study; one that is there is continued.
    laps : int
        Robots of each fault.
    seed : int
        Of the random numbers.
    jobs : int
        Not used: trials are examined one after the other.

    """
    trials = laps * len(INJECTED)
    if not study.already_made(folder, trials, seed):
        _make(folder, trials, seed)
    answers = study.diagnose_trials(folder, diagnose=_examine)
    return {"seeds": [seed], **score(answers, seal.unseal(folder))}


def _make(folder: Path, trials: int, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(trials)
    labels = {}
    with progress("making trials", trials) as advance:
        for index, place in enumerate(order):
            name = list(INJECTED)[place % len(INJECTED)]
            trial = f"trial-{index:03d}"
            write_trial(folder / study.TRIALS / trial, name, seed, index)
            labels[trial] = {"fault": name}
            advance(1)
    study.commit(folder, trials, seed, labels)


def _examine(folder: Path, jobs: int) -> dict[str, dict[str, Any]]:
    """Answers of all trials, one after the other: each takes a few seconds."""
    from clie_blocks.analysis.gap.simulator_faults.command import suspect_paths

    answers: dict[str, dict[str, Any]] = {}
    trials = sorted((folder / study.TRIALS).iterdir())
    with progress("examining simulators", len(trials)) as advance:
        for trial in trials:
            try:
                answers[trial.name] = json_types(
                    suspect_paths([trial], trial / MODEL).to_dict())
            except ClieError as error:
                answers[trial.name] = {"verdict": "error", "error": str(error), "faults": []}
            advance(1)
    return answers


def score(answers: dict[str, Any], labels: dict[str, Any]) -> dict[str, Any]:
    """Return the share of faults that are named first, and what was named in their place."""
    pairs = [(labels[trial]["fault"], answers[trial]["verdict"]) for trial in sorted(labels)]
    return {
        "named_first": rate(named == fault for fault, named in pairs if fault != NONE),
        "false_alarm": rate(named != NONE for fault, named in pairs if fault == NONE),
        "by_fault": {fault: rate(named == one for one, named in pairs if one == fault)
                     for fault in INJECTED},
        "wrong": [{"trial": trial, "fault": labels[trial]["fault"],
                   "named": answers[trial]["verdict"]} for trial in sorted(labels)
                  if answers[trial]["verdict"] != labels[trial]["fault"]]}


def is_missed(board: dict[str, Any]) -> bool:
    """Whether fewer faults are named first than sought."""
    return bool(board["named_first"]["rate"] < TARGET)


def terminal_lines(board: dict[str, Any]) -> list[str]:
    """Scoreboard for a terminal."""
    return [f"{board['command']}",
            f"  fault of a simulator named first: {share_text(board['named_first'])}, "
            f"sought {TARGET:.0%}",
            f"  false alarm on a sound simulator: {share_text(board['false_alarm'])}",
            *(f"  {row['trial']}: {row['fault']}, named {row['named']}"
              for row in board["wrong"])]
