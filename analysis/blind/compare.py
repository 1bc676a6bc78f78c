"""Other methods on the trials of a study: the baselines of today, and the diagnosis less a stage.

Every method is a function from robot and records to an answer in the form of ``clie diagnose``,
so that all are scored alike.  Answers are kept, so that a killed run continues.
"""

import json
import time

import numpy as np

from clie_blocks.analysis.blind.rates import rate
from clie_blocks.analysis.blind.score import score
from clie_blocks.analysis.blind.study import TRIALS, merged
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

FULL = "clie diagnose"
PARTS = "compared.parts"
SHOWN = ("trials", "top_1", "top_3", "joint", "pair_all_in_top_2", "false_alarm",
         "unknown_detected", "against_true_model", "seconds")


def methods(baselines, ablations):
    """Names of the methods to run.

    Parameters
    ----------
    baselines, ablations : bool
        Which groups.

    """
    from clie_blocks.analysis.blind.ablations import ABLATIONS
    from clie_blocks.analysis.blind.baselines import BASELINES

    return [*(BASELINES if baselines else ()), *(ABLATIONS if ablations else ())]


def compared(names, places, diagnoses, labels, subset=None, jobs=1):
    """Run methods on trials of a study and score them beside the diagnosis.

    Parameters
    ----------
    names : list of str
        From `methods`.
    places : dict
        Folder of each seed.
    diagnoses, labels : dict
        By seed, then by trial.
    subset : int, optional
        First trials of each seed; by default all.
    jobs : int
        Processes.

    Returns
    -------
    list of dict
        One row per method, the diagnosis first.

    """
    chosen = {seed: sorted(labels[seed])[:subset] for seed in places}
    truth = merged({seed: {name: labels[seed][name] for name in chosen[seed]} for seed in places})
    tasks = [(method, places[seed], name) for method in names for seed in places
             for name in chosen[seed]]
    answers = dict(zip(tasks, _spread(tasks, jobs)))
    by_method = {FULL: diagnoses, **{method: {seed: {
        name: answers[method, places[seed], name] for name in chosen[seed]} for seed in places}
        for method in names}}
    return [row(method, merged({seed: {name: found[seed][name] for name in chosen[seed]}
                                for seed in places}), truth)
            for method, found in by_method.items()]


def row(method, answers, truth):
    """Figures of one method."""
    found = score(answers, truth)
    return {"method": method, "ece": found["calibration"]["ece"],
            "failed": rate("error" in answer for answer in answers.values()),
            **{key: found[key] for key in SHOWN}}


def _spread(tasks, jobs):
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with (ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool,
          progress("comparing methods", len(tasks)) as advance):
        for answer in pool.map(_answered, tasks):
            yield answer
            advance(1)


def _answered(task):
    method, place, name = task
    kept = place / PARTS / _slug(method) / f"{name}.json"
    if kept.is_file():
        return json.loads(kept.read_text())
    text = to_json(_answer(method, place / TRIALS / name))
    write(kept, text)
    return json.loads(text)


def _slug(method):
    return method.replace(",", "").replace(" ", "-")


def _answer(method, path):
    from clie_blocks.analysis.blind.ablations import ABLATIONS
    from clie_blocks.analysis.blind.baselines import BASELINES
    from clie_blocks.analysis.gap.trials import Trial, read

    began = time.perf_counter()
    try:
        found = {**BASELINES, **ABLATIONS}[method](*read(Trial(path.name, (str(path),))))
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    except np.linalg.LinAlgError as error:
        return {"error": f"no solution: {error}", "exit_code": 4}
    return {**found, "seconds": time.perf_counter() - began}
