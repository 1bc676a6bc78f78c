"""A diagnosis as a document: the answer first, then what it rests on."""

from __future__ import annotations

import dataclasses

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report import checks, localisation
from clie_blocks.analysis.gap.report.cause_words import leading_rows
from clie_blocks.analysis.gap.report.causes import alternatives_section, causes_section
from clie_blocks.analysis.gap.report.formula import formula_section
from clie_blocks.analysis.gap.report.in_short import in_short
from clie_blocks.analysis.gap.report.parameters import parameters_section, simulator_section
from clie_blocks.analysis.gap.report.plots import motions
from clie_blocks.analysis.gap.report.signal_paths import signal_paths_section
from clie_blocks.analysis.gap.report.summary import headline
from clie_blocks.analysis.gap.report.torque_map import torque_map_section
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    Row,
    Units,
    number,
    units_of,
    with_prefix,
)
from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Picture, Section

MOODS = {"effect": GOOD, "parametric": GOOD, "none": GOOD, "unexplained": BAD,
         "not_identifiable": UNSURE}
VALIDATION = {"held-out logs": "a hold-out log, which was not used for fitting",
              "blocks left out of the fit": "blocks of the logs, or whole logs where they are "
              "short, each predicted by a model refitted without it (cross-validation)"}


def document(result: Result, answer: Answer, name: str) -> Document:
    """Arrange a diagnosis for a reader.

    Parameters
    ----------
    result : Result
        Every stage.
    answer : dict
        Its JSON answer.
    name : str
        Of the robot or trial.

    """
    units = units_of(result.problem.records)
    read = (
        localisation.block_section(answer["where"]["block"]),
        reduction_section(result, answer, units),
        causes_section(result, answer, units),
        alternatives_section(answer),
        simulator_section(result, answer))
    looked_up = (
        localisation.map_section(answer["where"], result.problem.joints, units),
        signal_paths_section(result, units),
        parameters_section(answer),
        Section("What Theorem 2 of the paper makes of it", (_theorem_2(answer["theorem_2"]),)),
        torque_map_section(result, units),
        formula_section(answer, units),
        checks.not_shown_section(answer),
        checks.checks_section(result, units),
        checks.assumptions_section(answer),
        checks.thresholds_section(result))
    folded = (dataclasses.replace(section, collapsed=True) for section in looked_up if section)
    return Document(f"Gap between {name} and its model", headline(answer), mood(answer),
                    (*filter(None, read), *folded), answers=in_short(answer))


def mood(answer: Answer) -> str:
    """Colour of the verdict: sure only where one cause is left."""
    if answer["verdict"] == "effect" and len(answer["set_90"]) > len(leading_rows(answer)):
        return UNSURE
    return MOODS[answer["verdict"]]


def reduction_section(result: Result, answer: Answer, units: Units) -> Section:
    """How far the gap shrinks, with the predicted motions overlaid."""
    logs = VALIDATION.get(answer["closed_percent"]["judged_on"],
                          "the log that was also used for fitting, since there is no other: "
                          "record a second one")
    text = (f"Both models are simulated {_simulated(result)}, on {logs}. The gap is the RMS "
            "prediction error, measured less simulated position, over all joints: "
            f"{with_prefix(answer['gap_before'], units['q'])} for the refitted nominal model, "
            f"{with_prefix(answer['gap_after'], units['q'])} for the corrected one; sensor noise "
            f"alone leaves {with_prefix(answer['gap_floor'], units['q'])}.")
    picture = Picture("motions", motions(result, units),
                      "Above: measured position and both predictions. Below: the prediction "
                      "errors, and one standard deviation of what sensor noise alone leaves.")
    return Section("How far the gap shrinks", (text,), pictures=(picture,))


def _simulated(result: Result) -> str:
    """What drives a model."""
    if result.problem.law.holds_joints and not result.controller.open_loop:
        return ("in closed loop, from the recorded command" if result.controller.recorded else
                "in closed loop, from reference and excitation alone")
    return ("from the recorded commands, with an observer that tracks the measured motion, since "
            "no known controller holds this machine")


def _theorem_2(predicted: Row) -> str:
    """What the paper's Theorem 2 makes of the modelling error, in words."""
    error, mu_1 = predicted["modelling_error"], predicted["mu_1"]
    text = (f"These errors correspond to a modelling error of eq. (29) of "
            f"{number(error['before'])} {error['unit']} before the correction and "
            f"{number(error['after'])} {error['unit']} after it")
    if mu_1["before"] is None or mu_1["after"] is None:
        return text + ("; Theorem 2 gives no bound of the estimation error, because its condition "
                       "is violated with these gains.")
    return (text + f"; by Theorem 2 the estimation error then stays within a radius mu_1 (A.5) of "
            f"{number(mu_1['before'])} before and {number(mu_1['after'])} after.")
