"""The files of a report."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.document import document
from clie_blocks.analysis.gap.report.wording import Answer
from clie_blocks.analysis.report.render import drawings, html
from clie_blocks.output import to_json, write

if TYPE_CHECKING:
    from clie_blocks.analysis.records import Record


def write_report(result: Result, answer: Answer, folder: str | os.PathLike[str],
                 name: str = "diagnosis") -> list[str]:
    """Write the report of a diagnosis and return the paths of its files.

    Parameters
    ----------
    result : Result
        From `clie_blocks.analysis.gap.diagnose`.
    answer : dict
        Its JSON answer, from `clie_blocks.analysis.gap.answer`.
    folder : path-like
        Where to.
    name : str
        File name without ending, and the title.

    Returns
    -------
    list of str
        ``NAME.html``, one self-contained page; ``NAME.json``, the answer; ``NAME.next.csv``,
        set-points of the recommended run, if there is one that the controller of the logs can
        follow.

    """
    experiment, set_points = result.next_experiment, {}
    if experiment and can_follow(result.problem.records):
        records = result.problem.records
        set_points["next.csv"] = experiment.set_points(records[0].units if records else None)
        answer = {**answer, "next_experiment": {**answer["next_experiment"],
                                                "set_points": f"{name}.next.csv"}}
    page = document(result, answer, name)
    texts = {"html": html(page, drawings(page)), **set_points}
    paths = [str(write(Path(folder) / f"{name}.{ending}", text))
             for ending, text in texts.items()]
    return [paths[0], str(write_answer(answer, folder, name)), *paths[1:]]


def write_answer(answer: Answer, folder: str | os.PathLike[str], name: str) -> Path:
    """Write ``NAME.json``, last of all files: it marks the report as complete."""
    return write(Path(folder) / f"{name}.json", to_json(answer))


def can_follow(records: Sequence[Record]) -> bool:
    """Whether set-points mean to the robot what they mean here: its logs are as they were read.

    Logs of servos and of machines without a known law are in angles and torques of the diagnosis.
    """
    return all(record.robot is None or record.robot.controller.velocity_filter != "difference"
               or np.any(record.robot.controller.kd) for record in records)
