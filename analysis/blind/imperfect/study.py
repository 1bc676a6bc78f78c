"""The study of imperfect logs from making to open labels, on one seed or several."""

import functools
from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.imperfect.runs import ANSWERS, run_all
from clie_blocks.analysis.blind.imperfect.trials import UNDAMAGED, make_trials
from clie_blocks.analysis.blind.protocol import study
from clie_blocks.analysis.blind.protocol.seal import unseal

Entries = dict[str, dict[str, Any]]  # by trial


def run_study(folder: Path, trials: int, seeds: list[int], jobs: int = 1
              ) -> tuple[Entries, Entries, Entries]:
    """Make, diagnose and open a study; return answers, answers on the twins, and labels.

    All trials are made and sealed before the first one is diagnosed, and all trials and twins are
    diagnosed before the first label is opened.
    """
    folders = study.seed_folders(folder, seeds)
    for seed, one in folders.items():
        make_trials(one, trials, seed, jobs)
    answers, twins = {}, {}
    for seed, one in folders.items():
        diagnose = functools.partial(run_all, kept=one / ANSWERS)
        answers[seed] = study.diagnose_trials(one, jobs, diagnose)
        twins[seed] = study.diagnose_trials(one / UNDAMAGED, jobs, diagnose)
    labels = {seed: _open(one) for seed, one in folders.items()}
    return (study.merge_seeds(answers), study.merge_seeds(twins), study.merge_seeds(labels))


def _open(folder: Path) -> Entries:
    """Labels of the robots, each with its damage."""
    damages, robots = unseal(folder), unseal(folder / UNDAMAGED)
    return {name: {**label, "damage": damages[name]} for name, label in robots.items()}
