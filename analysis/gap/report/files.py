"""The files of a report."""

from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.assessment.localisation import block_shares
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.report.document import document
from clie_blocks.analysis.gap.report.exports import corrected_model, force_per_command
from clie_blocks.analysis.report.render import drawings, html
from clie_blocks.output import to_json, write


def write_report(diagnosis, records, folder, name="diagnosis"):
    """Write the report of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `clie_blocks.analysis.gap.diagnose`.
    records : sequence of Record
        The logs that it was made from; their units and decisions are shown.
    folder : path-like
        Where to.
    name : str
        File name without ending, and the title.

    Returns
    -------
    list of str
        ``NAME.html``, one self-contained page; ``NAME.json``, the answer; ``NAME.xml``, the
        corrected joints for MuJoCo; ``NAME.next.csv``, set-points of the recommended run, if
        there is one that the controller of the logs can follow.

    """
    found, advice = answer(diagnosis, records), diagnosis.next_experiment
    found["where"] = {**found["where"], "block": block_shares(diagnosis)}
    extra = {}
    if advice and can_follow(records):
        found["next_experiment"]["set_points"] = f"{name}.next.csv"
        extra["next.csv"] = advice.set_points()
    page = document(diagnosis, found, records, name)
    texts = {"html": html(page, drawings(page)), "json": to_json(found),
             "xml": corrected_model(diagnosis, force_per_command(diagnosis, records)), **extra}
    return [str(write(Path(folder) / f"{name}.{ending}", text))
            for ending, text in texts.items()]


def can_follow(records):
    """Whether set-points mean to the robot what they mean here: its logs are as they were read.

    Logs of servos and of machines without a known law are in angles and torques of the diagnosis.
    """
    return all(record.robot is None or record.robot.controller.velocity_filter != "difference"
               or np.any(record.robot.controller.kd) for record in records)
