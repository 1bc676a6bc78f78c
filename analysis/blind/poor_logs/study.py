"""The study of poorer logs: made, sealed, diagnosed, unsealed, scored."""

from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.poor_logs.scoring import is_missed, score, terminal_lines
from clie_blocks.analysis.blind.poor_logs.trials import draw_trial, write_trial
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
        Robots.
    seed : int
        Of the random numbers.
    jobs : int
        Processes.

    """
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    study.make_in_parallel(folder, trials, seed, jobs, _make_one)
    return score(study.diagnose_trials(folder, jobs), seal.unseal(folder), class_of)


def _make_one(folder: Path, seed: int, index: int) -> tuple[str, dict[str, Any]]:
    trial, name = draw_trial(seed, index), f"trial-{index:03d}"
    write_trial(trial, folder / name)
    return name, json_types(trial.label)
