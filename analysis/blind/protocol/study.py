"""A study: make trials, seal their labels, diagnose them, open the labels."""

import json
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from clie_blocks.analysis.blind.population.maker import Population, make_trial
from clie_blocks.analysis.blind.population.standard import STANDARD
from clie_blocks.analysis.blind.protocol import seal
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

TRIALS, DIAGNOSES = "trials", "diagnoses.json"
OPEN = "labels.open"  # labels while trials are made, so that a killed run continues
Entry = TypeVar("Entry")
MakeOne = Callable[[Path, int, int], tuple[str, dict[str, Any]]]
Diagnose = Callable[[Path, int], dict[str, dict[str, Any]]]


def seed_folders(folder: str | os.PathLike[str], seeds: Sequence[int]) -> dict[int, Path]:
    """Return the folder of each seed: the study's own for one seed, one below it for more."""
    folder = Path(folder)
    return {seeds[0]: folder} if len(seeds) == 1 else {
        seed: folder / f"seed-{seed}" for seed in seeds}


def merge_seeds(by_seed: dict[int, dict[str, Entry]]) -> dict[str, Entry]:
    """Return the trials of several seeds as one dictionary; their names carry the seed."""
    if len(by_seed) == 1:
        return next(iter(by_seed.values()))
    return {f"{seed}/{name}": entry for seed, entries in by_seed.items()
            for name, entry in entries.items()}


def make_trials(folder: str | os.PathLike[str], trials: int, seed: int, jobs: int = 1,
                population: Population = STANDARD) -> None:
    """Make the trials of a study and seal their labels; an existing study is kept.

    Raises
    ------
    ClieError
        If the folder holds another study.

    """
    folder = Path(folder)
    if already_made(folder, trials, seed):
        shutil.rmtree(folder / OPEN, ignore_errors=True)  # of a run killed after its seal
        return
    labels = dict(sorted(_make_in_parallel(folder, trials, seed, jobs, population)))
    if already_made(folder, trials, seed):  # another process was faster
        return
    commit(folder, trials, seed, labels)
    shutil.rmtree(folder / OPEN)


def make_in_parallel(folder: Path, trials: int, seed: int, jobs: int, make_one: MakeOne) -> None:
    """Make the trials of a study and seal their labels; an existing study is kept.

    Parameters
    ----------
    folder : Path
        Of the study.
    trials, seed, jobs : int
        How many, their random numbers, and processes.
    make_one : callable
        ``make_one(folder, seed, index)`` writes a trial below a folder; returns name and label.

    """
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    if already_made(folder, trials, seed):
        return
    labels = {}
    with workers(jobs) as pool, progress("making trials", trials) as advance:
        running = [pool.submit(make_one, folder / TRIALS, seed, index) for index in range(trials)]
        for future in as_completed(running):
            name, labels[name] = future.result()
            advance(1)
    commit(folder, trials, seed, dict(sorted(labels.items())))


def commit(folder: Path, trials: int, seed: int, labels: dict[str, dict[str, Any]]) -> None:
    """Write the digest of the trials of a study into its log, and seal their labels."""
    seal.append_event(folder, "made", trials=trials, seed=seed,
                      digest=seal.folder_digest(folder / TRIALS))
    seal.seal(folder, labels)


def already_made(folder: Path, trials: int, seed: int) -> bool:
    """Whether the trials of a study are made and sealed; another study there is an error."""
    lines = seal.read_log(folder)
    made = next((line for line in lines if line["event"] == "made"), None)
    if made is not None and (made["trials"], made["seed"]) != (trials, seed):
        raise ClieError(f"{folder} holds a study of {made['trials']} trials with seed "
                        f"{made['seed']}; choose another folder with -o DIR")
    return any(line["event"] == "sealed" for line in lines)  # else killed between the two


def _diagnose_side_by_side(folder: Path, jobs: int) -> dict[str, dict[str, Any]]:
    from clie_blocks.analysis.gap import batch

    tasks = batch.find_tasks([folder / TRIALS])
    return dict(batch.diagnose_all(tasks, jobs=jobs, folder=folder / f"{DIAGNOSES}.parts"))


def diagnose_trials(folder: str | os.PathLike[str], jobs: int = 1,
                    diagnose: Diagnose = _diagnose_side_by_side) -> dict[str, dict[str, Any]]:
    """Diagnose all trials of a study through the public interface; return answers by trial.

    What was answered stays as it was, also where a robot got no answer: another version of the
    package, whose authors have seen the labels, answers nothing in its place.

    Parameters
    ----------
    folder : path-like
        Of the study.
    jobs : int
        Trials diagnosed in parallel.
    diagnose : callable, optional
        ``diagnose(folder, jobs)`` returns answers by trial.

    Raises
    ------
    ClieError
        If the trials are not those that were sealed.

    """
    folder = Path(folder)
    made = [line for line in seal.read_log(folder) if line["event"] == "made"][-1]
    if made["digest"] != seal.folder_digest(folder / TRIALS):
        raise ClieError(f"the trials in {folder / TRIALS} were changed since they were made; "
                        "their diagnoses would not be blind: make the study anew")
    answered = _answers_on_record(folder)
    if answered is not None:
        return answered
    answers = diagnose(folder, jobs)
    text = to_json(dict(sorted(answers.items())))
    write(folder / DIAGNOSES, text)
    seal.append_event(folder, "diagnosed", trials=len(answers), digest=seal.digest(text.encode()))
    return json.loads(text)


def _answers_on_record(folder: Path) -> dict[str, dict[str, Any]] | None:
    """Answers by trial that the log of a study has the digest of; None without any."""
    file = folder / DIAGNOSES
    recorded = [line["digest"] for line in seal.read_log(folder) if line["event"] == "diagnosed"]
    if not recorded or not file.is_file():
        return None
    text = file.read_text(encoding="utf-8")
    return json.loads(text) if seal.digest(text.encode()) == recorded[-1] else None


def run_sealed(folder: str | os.PathLike[str], trials: int, seed: int, jobs: int = 1,
               population: Population = STANDARD) -> tuple[dict[str, Any], dict[str, Any]]:
    """Make, diagnose and open a study in one go; return diagnoses and labels, each by trial."""
    make_trials(folder, trials, seed, jobs, population)
    return diagnose_trials(folder, jobs), seal.unseal(Path(folder))


def _make_in_parallel(folder: Path, trials: int, seed: int, jobs: int,
                      population: Population) -> Iterator[tuple[str, dict[str, Any]]]:
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    with workers(jobs) as pool:
        running = [pool.submit(_make_one, folder, seed, index, population)
                   for index in range(trials)]
        with progress("making trials", trials) as advance:
            for future in as_completed(running):
                yield future.result()
                advance(1)


def _make_one(folder: Path, seed: int, index: int,
              population: Population) -> tuple[str, dict[str, Any]]:
    """Make a trial unless it is on disk; return its name and label."""
    from clie_blocks.analysis.blind.population.files import write_trial

    name = f"trial-{index:03d}"
    kept = folder / OPEN / f"{seed}-{index}.json"
    if kept.is_file():
        return name, json.loads(kept.read_text())
    trial = make_trial(population, seed, index)
    write_trial(trial, folder / TRIALS / name)
    text = to_json(trial.label)
    write(kept, text)
    return name, json.loads(text)
