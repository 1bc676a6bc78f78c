"""The study of recommended runs: made, sealed, followed to one name, unsealed, scored."""

from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.experiments.rounds import follow
from clie_blocks.analysis.blind.experiments.scoring import is_missed, score, terminal_lines
from clie_blocks.analysis.blind.experiments.trials import write_one
from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.output import progress

__all__ = ["is_missed", "run_study", "terminal_lines"]
FOLLOWED = "followed"  # folder of the robots with their new logs


def run_study(folder: Path, trials: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make robots, follow what their diagnoses recommend, open the labels, return the figures.

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

    study.make_in_parallel(folder, trials, seed, jobs, write_one)

    def follow_all(folder: Path, jobs: int) -> dict[str, Any]:
        return _follow_all(folder, trials, seed, jobs)

    answers = study.diagnose_trials(folder, jobs, follow_all)
    rounds = {name: one["rounds"] for name, one in answers.items()}
    return {"seed": seed, **score(rounds, seal.unseal(folder), class_of)}


def _follow_all(folder: Path, trials: int, seed: int, jobs: int) -> dict[str, Any]:
    """Rounds of all trials, by name."""
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    found = {}
    with workers(jobs) as pool, progress("following recommendations", trials) as advance:
        running = {pool.submit(follow, folder / FOLLOWED / name, seed, index): name
                   for index, name in ((k, f"trial-{k:03d}") for k in range(trials))}
        for future in as_completed(running):
            found[running[future]] = {"rounds": future.result()}
            advance(1)
    return found
