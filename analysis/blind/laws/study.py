"""The study of laws: made, sealed, diagnosed, unsealed, scored."""

from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.laws.scoring import is_missed, score, terminal_lines
from clie_blocks.analysis.blind.laws.trials import (
    TRIAL,
    TWIN,
    draw_trial,
    write_trial,
    write_twin,
)
from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.output import json_types

__all__ = ["is_missed", "run_study", "terminal_lines"]

def run_study(folder: Path, trials: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make, diagnose and open a study, and return its figures.

    Parameters
    ----------
    folder : Path
        Of the study; one that is there is continued.
    trials : int
        Robots under laws; those with an effect are also run under PD as stated.
    seed : int
        Of the random numbers.
    jobs : int
        Processes.

    """
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    study.make_in_parallel(folder, trials, seed, jobs, _make_one)
    return score(study.diagnose_trials(folder, jobs), seal.unseal(folder), class_of)


def _make_one(folder: Path, seed: int, index: int) -> tuple[str, dict[str, Any]]:
    trial = draw_trial(seed, index)
    name = f"{TRIAL}-{index:03d}"
    write_trial(trial, folder / name)
    if trial.effect.name:
        write_twin(trial, folder / f"{TWIN}-{index:03d}")
    return name, json_types(trial.label)
