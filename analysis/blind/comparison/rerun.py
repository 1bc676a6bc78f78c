"""Trials of a study answered again by other methods, in parallel, once their labels are open.

Every method is a function from a problem to an answer in the form of ``clie diagnose``, so that
all are scored alike.  Answers are kept, so that a killed run continues.
"""

import functools
import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.blind.protocol.study import TRIALS
from clie_blocks.errors import ClieError
from clie_blocks.output import progress, to_json, write

if TYPE_CHECKING:
    from clie_blocks.analysis.gap.problem.problem import Problem

PARTS = "repeats.parts"
WITHOUT = "without "  # prefix of the diagnosis with one effect removed from its library
AnswerTask = tuple[str, Path, str]  # method, folder of the seed, name of the trial


def answer_again(tasks: Sequence[AnswerTask], jobs: int = 1) -> dict[AnswerTask, dict[str, Any]]:
    """Answer trials again; return the answer of each task."""
    return dict(zip(tasks, _answer_in_parallel(tasks, jobs)))


def find_method(name: str) -> "Callable[[Problem], dict[str, Any]]":
    """Return the method of a name: a baseline, an ablation, or `WITHOUT` and an effect."""
    from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS, diagnose_with
    from clie_blocks.analysis.blind.comparison.baselines import BASELINES

    if name.startswith(WITHOUT):
        return functools.partial(diagnose_with, exclude=(name.removeprefix(WITHOUT),))
    return {**BASELINES, **ABLATIONS}[name]


def _answer_in_parallel(tasks: Sequence[AnswerTask], jobs: int) -> Iterator[dict[str, Any]]:
    from clie_blocks.analysis.workers import workers

    with (workers(jobs) as pool, progress("answering again", len(tasks)) as advance):
        for answer in pool.map(answer_task, tasks):
            yield answer
            advance(1)


def answer_task(task: AnswerTask) -> dict[str, Any]:
    """Answer of one task, read again if it is on disk."""
    name, folder, trial = task
    kept = folder / PARTS / _slug(name) / f"{trial}.json"
    if kept.is_file():
        return json.loads(kept.read_text())
    text = to_json(_answer(name, folder / TRIALS / trial))
    write(kept, text)
    return json.loads(text)


def _slug(name: str) -> str:
    return name.replace(",", "").replace(" ", "-")


def _answer(name: str, path: Path) -> dict[str, Any]:
    from clie_blocks.analysis.gap.batch import read

    began = time.perf_counter()
    try:
        answer = find_method(name)(read(path))
    except ClieError as error:
        return {"error": str(error), "exit_code": error.exit_code}
    except np.linalg.LinAlgError as error:
        return {"error": f"no solution: {error}", "exit_code": 4}
    return {**answer, "seconds": time.perf_counter() - began}
