"""The command of a user, run on every trial: ``clie diagnose FOLDER --json`` in a process.

A process of its own shows what a user would see: an exit code, a traceback, or no answer at all.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from clie_blocks import __version__
from clie_blocks.analysis.blind.protocol import seal
from clie_blocks.analysis.blind.protocol.study import TRIALS
from clie_blocks.analysis.blind.scoring.timings import FILE
from clie_blocks.output import progress, to_json, write

ANSWERS = "answers"
LIMIT = 900.0  # s of wall clock after which nobody waits for an answer
NO_ANSWER = 124  # exit code
BUDGET = 600.0  # s for the search: equal runs give equal answers, however busy the machine is
COMMAND = (sys.executable, "-m", "clie_blocks.analysis.gap.command")


def run_all(folder: Path, jobs: int, kept: Path) -> dict[str, dict[str, Any]]:
    """Run the command on all trials of a study; return answers by trial, without their seconds.

    Parameters
    ----------
    folder : pathlib.Path
        Of the study; the seconds go into its ``timings.json``.
    jobs : int
        Processes.
    kept : pathlib.Path
        Folder that keeps each answer by the digest of its trial, so that equal folders are
        diagnosed once and a killed run continues.

    """
    from concurrent.futures import ThreadPoolExecutor

    trials = sorted((folder / TRIALS).iterdir())
    with ThreadPoolExecutor(jobs) as pool, progress("diagnosing", len(trials)) as advance:
        answers = {}
        for trial, answer in zip(trials, pool.map(lambda one: run(one, kept), trials)):
            answers[trial.name] = answer
            advance(1)
    seconds = {name: answer.pop("seconds", None) for name, answer in answers.items()}
    write(folder / FILE, to_json({"seconds": seconds}))
    return answers


def run(trial: Path, kept: Path) -> dict[str, Any]:
    """Answer of the command on a folder, read again if it is on disk.

    Its ``seconds`` are those of the process; files are named without their folder.  Where there is
    no diagnosis it is ``{"error": text, "exit_code": int}``; the code is 124 where there was no
    answer in time.
    """
    path = kept / f"{__version__}-{seal.folder_digest(trial)[:32]}.json"
    if path.is_file():
        return json.loads(path.read_text())
    began = time.perf_counter()
    answer = {**_answer(trial), "seconds": time.perf_counter() - began}
    write(path, to_json(answer))
    return json.loads(path.read_text())


def _answer(trial: Path) -> dict[str, Any]:
    try:
        done = subprocess.run([*COMMAND, str(trial), "--json", "--seconds", f"{BUDGET:g}"],
                              capture_output=True, text=True, timeout=LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return {"error": f"no answer in {LIMIT:g} s", "exit_code": NO_ANSWER}
    said, complained = (text.replace(f"{trial}{os.sep}", "") for text in (done.stdout,
                                                                          done.stderr))
    try:
        return json.loads(said)
    except ValueError:
        last = complained.strip().splitlines()[-1:] or ["nothing was printed"]
        return {"error": last[0], "exit_code": done.returncode}
