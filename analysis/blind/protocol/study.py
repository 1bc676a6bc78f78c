"""A study: make trials, seal their labels, diagnose them, open the labels."""

import json
import shutil
from pathlib import Path

from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.blind.population.standard import HIDDEN
from clie_blocks.analysis.blind.protocol import seal
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

TRIALS, DIAGNOSES = "trials", "diagnoses.json"
OPEN = "labels.open"  # labels while trials are made, so that a killed run continues


def folders(folder, seeds):
    """Return the folder of each seed: the study's own for one seed, one below it for more."""
    folder = Path(folder)
    return {seeds[0]: folder} if len(seeds) == 1 else {
        seed: folder / f"seed-{seed}" for seed in seeds}


def merged(by_seed):
    """Trials of several seeds as one dictionary; their names carry the seed."""
    if len(by_seed) == 1:
        return next(iter(by_seed.values()))
    return {f"{seed}/{name}": entry for seed, entries in by_seed.items()
            for name, entry in entries.items()}


def make(folder, trials, seed, jobs=1, family=HIDDEN):
    """Make the trials of a study and seal their labels; a study that stands is kept.

    Parameters
    ----------
    folder : path-like
        Of the study.
    trials, seed : int
        How many, and the seed of all of them.
    jobs : int
        Processes.
    family : Family
        Kind of trials.

    Raises
    ------
    ClieError
        If the folder holds another study.

    """
    folder = Path(folder)
    if _stands(folder, trials, seed):
        return
    labels = dict(sorted(_spread(folder, trials, seed, jobs, family)))
    if _stands(folder, trials, seed):  # another process was faster
        return
    seal.note(folder, "made", trials=trials, seed=seed,
              digest=seal.folder_digest(folder / TRIALS))
    seal.seal(folder, labels)
    shutil.rmtree(folder / OPEN)


def _stands(folder, trials, seed):
    made = next((line for line in seal.verified(folder) if line["event"] == "made"), None)
    if made is not None and (made["trials"], made["seed"]) != (trials, seed):
        raise ClieError(f"{folder} holds a study of {made['trials']} trials with seed "
                        f"{made['seed']}; choose another folder with -o DIR")
    return made is not None


def diagnose(folder, jobs=1):
    """Diagnose all trials of a study through the public interface.

    Parameters
    ----------
    folder : path-like
        Of the study.
    jobs : int
        Processes.

    Returns
    -------
    dict
        Answers by trial.

    Raises
    ------
    ClieError
        If the trials are not those that were sealed.

    """
    from clie_blocks.analysis.gap import batch

    folder = Path(folder)
    made = next(line for line in seal.verified(folder) if line["event"] == "made")
    if made["digest"] != seal.folder_digest(folder / TRIALS):
        raise ClieError(f"the trials in {folder / TRIALS} were changed since they were made; "
                        "their diagnoses would not be blind: make the study anew")
    found = batch.find_tasks([folder / TRIALS])
    answers = dict(batch.diagnose_all(found, jobs=jobs, folder=folder / f"{DIAGNOSES}.parts"))
    text = to_json(dict(sorted(answers.items())))
    write(folder / DIAGNOSES, text)
    seal.note(folder, "diagnosed", trials=len(answers), digest=seal.digest(text.encode()))
    return json.loads(text)


def sealed(folder, trials, seed, jobs=1, family=HIDDEN):
    """Make, diagnose and open a study in one go.

    Parameters
    ----------
    folder : path-like
        Of the study.
    trials, seed, jobs : int
        How many, the seed of all of them, processes.
    family : Family
        Kind of trials.

    Returns
    -------
    diagnoses, labels : dict
        By trial.

    """
    make(folder, trials, seed, jobs, family)
    return diagnose(folder, jobs), seal.unseal(Path(folder))


def _spread(folder, trials, seed, jobs, family):
    from concurrent.futures import as_completed

    from clie_blocks.analysis.workers import workers

    with workers(jobs) as pool:
        running = [pool.submit(_made, folder, seed, index, family) for index in range(trials)]
        with progress("making trials", trials) as advance:
            for future in as_completed(running):
                yield future.result()
                advance(1)


def _made(folder, seed, index, family):
    from clie_blocks.analysis.blind.population.files import write_trial

    name = f"trial-{index:03d}"
    kept = folder / OPEN / f"{seed}-{index}.json"
    if kept.is_file():
        return name, json.loads(kept.read_text())
    trial = make_trial(family, seed, index)
    write_trial(trial, folder / TRIALS / name)
    text = to_json(trial.label)
    write(kept, text)
    return name, json.loads(text)
