"""Trials of a study answered again in other ways, side by side, once their labels are open.

Every method is a function from robot and records to an answer in the form of ``clie diagnose``,
so that all are scored alike.  Answers are kept, so that a killed run continues.
"""

import functools
import json
import time

import numpy as np

from clie_blocks.analysis.blind.protocol.study import TRIALS
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

PARTS = "repeats.parts"
WITHOUT = "without "  # how the diagnosis is called that lacks one effect in its library


def repeated(tasks, jobs=1):
    """Answer trials again.

    Parameters
    ----------
    tasks : list of (str, pathlib.Path, str)
        Method, folder of the seed, name of the trial.
    jobs : int
        Processes.

    Returns
    -------
    dict
        Answer of each task.

    """
    return dict(zip(tasks, _spread(tasks, jobs)))


def method(name):
    """Return the method of a name: a baseline, an ablation, or `WITHOUT` and an effect."""
    from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS, diagnosed
    from clie_blocks.analysis.blind.comparison.baselines import BASELINES

    if name.startswith(WITHOUT):
        return functools.partial(diagnosed, exclude=(name.removeprefix(WITHOUT),))
    return {**BASELINES, **ABLATIONS}[name]


def _spread(tasks, jobs):
    from clie_blocks.analysis.workers import workers

    with (workers(jobs) as pool, progress("answering again", len(tasks)) as advance):
        for answer in pool.map(answered, tasks):
            yield answer
            advance(1)


def answered(task):
    """Answer of one task, found again if it is on disk."""
    name, place, trial = task
    kept = place / PARTS / _slug(name) / f"{trial}.json"
    if kept.is_file():
        return json.loads(kept.read_text())
    text = to_json(_answer(name, place / TRIALS / trial))
    write(kept, text)
    return json.loads(text)


def _slug(name):
    return name.replace(",", "").replace(" ", "-")


def _answer(name, path):
    from clie_blocks.analysis.gap.batch import Task, read

    began = time.perf_counter()
    try:
        found = method(name)(*read(Task(path.name, (str(path),))))
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    except np.linalg.LinAlgError as error:
        return {"error": f"no solution: {error}", "exit_code": 4}
    return {**found, "seconds": time.perf_counter() - began}
