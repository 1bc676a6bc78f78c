"""A diagnosis as a document: the answer first, then what it stands on."""

from clie_blocks.analysis.gap.fitting.observer import is_open_loop
from clie_blocks.analysis.gap.report import checks, localisation
from clie_blocks.analysis.gap.report.causes import causes_section, confusion_section
from clie_blocks.analysis.gap.report.parameters import parameters_section, simulator_section
from clie_blocks.analysis.gap.report.plots import motions
from clie_blocks.analysis.gap.report.signal_paths import signal_paths_section
from clie_blocks.analysis.gap.report.torque_map import torque_map_section
from clie_blocks.analysis.gap.report.wording import (
    FOREIGN,
    at_joints,
    confounded,
    effect_title,
    family_of,
    family_probability,
    join_words,
    likely_family,
    number,
    parameter_deviations,
    percent,
    units_of,
    with_prefix,
)
from clie_blocks.analysis.gap.verdict.posterior import LIKELY
from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Picture, Section

MOODS = {"effect": GOOD, "parametric": GOOD, "none": GOOD, "unexplained": BAD,
         "not_identifiable": UNSURE}


def document(diagnosis, answer, records, name):
    """Arrange a diagnosis for a reader.

    Parameters
    ----------
    diagnosis : Diagnosis
        Every stage.
    answer : dict
        Its JSON answer, with the shares by block.
    records : sequence of Record
        The logs.
    name : str
        Of the robot or trial.

    Returns
    -------
    Document
        Ready to be written.

    """
    units, joints = units_of(records), diagnosis.problem.joints
    sections = (
        localisation.block_section(answer["where"]["block"]),
        far_section(diagnosis, answer, units),
        causes_section(diagnosis, answer, units),
        localisation.map_section(answer["where"], joints, units),
        confusion_section(answer),
        signal_paths_section(diagnosis, units),
        parameters_section(diagnosis, answer, units),
        simulator_section(diagnosis, answer, records),
        torque_map_section(diagnosis, answer, units),
        checks.checks_section(diagnosis, units),
        checks.decisions_section(diagnosis, records))
    return Document(f"Gap between {name} and its model", sentence(answer, joints),
                    mood(answer), tuple(filter(None, sections)), facts(answer, units))


def mood(answer):
    """Colour of the verdict: sure only where one cause is left."""
    if answer["verdict"] == "effect" and len(answer["set_90"]) > len(_leading(answer)):
        return UNSURE
    return MOODS[answer["verdict"]]


def sentence(answer, joints):
    """Return the verdict in one sentence.

    Parameters
    ----------
    answer : dict
        The JSON answer.
    joints : sequence of str
        Names.

    """
    closed = answer["closed_percent"]
    unsure = answer["verdict"] == "not_identifiable"
    bought = "" if closed["value"] is None else (
        f"; with {'the likeliest' if unsure else 'it'} the model loses "
        f"{number(closed['value'])} % of its reducible gap on "
        + ("unseen data" if closed["unseen_data"] else "the data that it was fitted to"))
    if answer["verdict"] == "none":
        return "The model agrees with the robot down to the noise of its sensors."
    if answer["verdict"] == "parametric":
        wrong = "; ".join(parameter_deviations(answer, joints))
        return "The model is right but its numbers are not" + (f": {wrong}." if wrong else ".")
    if answer["verdict"] == "unexplained":
        by = "the nearest" if answer.get("controller_as_stated", True) else (
            "its controller is not the stated one, and the law that ran")
        nearest = "" if closed["value"] is None else (
            f"; {by} removes {number(closed['value'])} % of the reducible gap")
        for row in confounded(answer)[:1]:
            return (f"These logs cannot tell {FOREIGN[row['rival']]} from "
                    f"{_named([row], joints, answer)}{nearest}.")
        return f"Something is there that no effect of the library explains{nearest}." + _beside(
            answer, joints)
    if unsure:
        return f"These logs cannot tell which it is: {_undecided(answer, joints)}{bought}."
    return f"The model lacks {_named(_leading(answer), joints, answer)}{bought}."


def _named(rows, joints, answer):
    return join_words(f"{effect_title(row['effect'])}{at_joints(row['joint'], joints)} "
                  f"({percent(row['probability'])}{_of_its_kind(answer, row)})" for row in rows)


def _of_its_kind(answer, row):
    """How sure the family of an effect is, where the effect itself is not."""
    family = family_probability(answer, row)
    return f"; {family[0]} {percent(family[1])}" if family else ""


def _beside(answer, joints):
    """Causes that are sure though something else is there, too."""
    sure = [row for row in answer["effects"]
            if row["probability"] >= LIKELY and row["effect"] not in ("none", "unknown")]
    return f" Beside it the model lacks {_named(sure, joints, answer)}." if sure else ""


def _undecided(answer, joints):
    """What is left where no name is likely: the family that is, or all names."""
    likely = likely_family(answer, LIKELY)
    if not likely:
        return join_words(map(effect_title, answer["set_90"]), "or")
    family, probability, row = likely
    return (f"{family_of(family)} ({percent(probability)}), most likely {effect_title(row['effect'])}"
            f"{at_joints(row['joint'], joints)} ({percent(row['probability'])})")


def _leading(answer):
    """Rows of the causes that are likely, or of the likeliest alone."""
    rows = [row for row in answer["effects"] if row["effect"] not in ("none", "unknown")]
    return [row for row in rows if row["probability"] >= LIKELY] or rows[:1]


def facts(answer, units):
    """Return the numbers that are read first, as (name, value) pairs."""
    closed, unit = answer["closed_percent"], units["q"]
    interval = closed["interval"]
    return (
        ("gap before", with_prefix(answer["gap_before"], unit)),
        ("gap after", with_prefix(answer["gap_after"], unit)),
        ("sensor noise in the loop", with_prefix(answer["gap_floor"], unit)),
        ("closed", "-" if closed["value"] is None else f"{number(closed['value'])} %"
         + (f" ({number(interval[0])} .. {number(interval[1])})" if interval else "")),
        ("causes that remain", join_words(map(effect_title, answer["set_90"])) or "-"))


def far_section(diagnosis, answer, units):
    """How far the gap shrinks, with the predicted motions overlaid."""
    logs = {"held-out logs": "a log that was not used for fitting",
            "blocks left out of the fit": "blocks of the logs, or whole logs where they are "
            "short, each predicted by a model refitted without it (cross-validation)"}.get(
        answer["closed_percent"]["judged_on"],
        "the log that was also fitted, since there is no other: give a second one")
    text = (f"Both models are simulated {_driven(diagnosis)}, on "
            f"{logs}. The gap is the RMS of measured less predicted position over all joints: "
            f"{with_prefix(answer['gap_before'], units['q'])} refitted without a cause, "
            f"{with_prefix(answer['gap_after'], units['q'])} with it; sensor noise alone leaves "
            f"{with_prefix(answer['gap_floor'], units['q'])}.")
    text += _theorem_2(answer["theorem_2"])
    picture = Picture("motions", motions(diagnosis, units),
                      "Above: measured position and both predictions. Below: what each of them "
                      "misses, and one standard deviation of what sensor noise alone leaves.")
    return Section("How far the gap shrinks", (text,), pictures=(picture,))


def _driven(diagnosis):
    """What a model gets."""
    if not is_open_loop(diagnosis.problem.law):
        return "in closed loop from reference and excitation alone"
    if diagnosis.problem.held_out:
        return "from the commands alone, for nothing holds this machine"
    return "from the commands, led along the measured motion by an observer"


def _theorem_2(predicted):
    """What the paper's Theorem 2 makes of the modelling error, in words."""
    error, mu_1 = predicted["modelling_error"], predicted["mu_1"]
    told = (f" The modelling error of eq. (29), read from these errors, is "
            f"{number(error['before'])} rad/s^2 before and {number(error['after'])} after")
    if mu_1["before"] is None or mu_1["after"] is None:
        return told + "; Theorem 2 gives no radius, for its condition fails with these gains."
    return (told + f"; Theorem 2 then bounds the estimation error by a radius mu_1 (A.5) of "
            f"{number(mu_1['before'])} before and {number(mu_1['after'])} after.")
