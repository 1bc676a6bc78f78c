"""Which effect: ranked causes, and those that this log cannot tell apart."""

from clie_blocks.analysis.gap.report.plots import probabilities, residuals
from clie_blocks.analysis.gap.report.wording import (
    FOREIGN,
    confounded,
    effect_title,
    join_words,
    number,
    percent,
)
from clie_blocks.analysis.gap.verdict.confounders import CONTACT, SOFT_STOP
from clie_blocks.analysis.report.document import Picture, Section, Table
from clie_blocks.effects import LIBRARY

SHOWN = 8
NO_RUN = " No run that was tried in simulation would tell them apart: with these numbers their "  \
    "models move alike."
MARKS = ((0.5, "good"), (0.05, "unsure"))
SURE = 0.9  # a cause that is there, whatever else is: it stands for no other
TOLD_APART = {
    CONTACT: "it is met at a place where the robot is at no other time, and a torque from then on "
             "moves it alike. A run that comes back to the place, and leaves it again, tells",
    SOFT_STOP: "over this travel they, and any other torque that bends with the pose, move the "
               "robot alike. A run over a longer travel tells"}
TELLS = 1.0  # chi^2 between two causes, below which a run tells nothing


def causes_section(diagnosis, answer, units):
    """Ranked causes with their probabilities; what is left, where nothing explains it."""
    rows = answer["effects"][:SHOWN]
    names = diagnosis.problem.joints
    table = Table(
        ("cause", "joint", "probability", "looks like"),
        tuple((effect_title(row["effect"]), join_words(names[k - 1] for k in row["joint"] or ()) or "-",
               percent(row["probability"]), _signature(row["effect"])) for row in rows),
        marks=tuple(_mark(row["probability"]) for row in rows))
    text = ("Probabilities of several causes at once add up over all combinations in which they "
            "occur. A shrunken gap alone does not prove a cause.")
    pictures = [Picture("causes", probabilities(rows), "Probability of each cause.")]
    if answer["verdict"] == "unexplained":
        pictures.append(Picture("left", residuals(diagnosis, units),
                                "What the best model leaves at the worst joint, against what "
                                "could cause it; a shape in one panel is a clue."))
    return Section("Which effect causes it", (text,), tables=(table,), pictures=tuple(pictures))


def _mark(probability):
    return next((mark for least, mark in MARKS if probability >= least), "")


def _signature(name):
    return LIBRARY[name].signature if name in LIBRARY else "-"


def confusion_section(answer):
    """What this log cannot tell apart, and the run that could."""
    sure = {row["effect"] for row in answer["effects"] if row["probability"] >= SURE}
    remaining = [name for name in answer["set_90"] if name in LIBRARY and name not in sure]
    pairs = [(one, other) for i, one in enumerate(remaining) for other in remaining[i + 1:]]
    rows = tuple((f"{effect_title(one)} or {effect_title(other)}", _experiment(one, other))
                 for one, other in pairs)
    foreign = tuple(_foreign(answer))
    if not rows:
        return Section("Causes that look alike", (_single(answer),),
                       points=(*foreign, *_look_alikes(answer)))
    menu = tuple(_menu(answer))
    text = (f"This log cannot tell {join_words(map(effect_title, remaining))} apart: nine tenths of the "
            "probability are shared among them and what is sure.")
    return Section("Causes that look alike", (text if menu else text + NO_RUN,),
                   tables=(Table(("which", "what separates them"), rows), *menu),
                   points=foreign)


def _single(answer):
    if answer["verdict"] != "effect":
        return "No two causes of the library compete for this gap."
    return ("One answer holds more than nine tenths of the probability. These causes look alike "
            "in general; the experiments below rule them out for good.")


def _foreign(answer):
    """What outside the library moves the robot just as a cause that is named."""
    for row in confounded(answer):
        foreign = row["rival"]
        yield f"{effect_title(row['effect'])} or {FOREIGN[foreign]}: {TOLD_APART[foreign]}."


def _look_alikes(answer):
    for name in answer["set_90"]:
        if name in LIBRARY:
            for other, experiment in LIBRARY[name].confused_with.items():
                yield f"{effect_title(name)} or {effect_title(other)}: {experiment}."


def _experiment(one, other):
    return (LIBRARY[one].confused_with.get(other) or LIBRARY[other].confused_with.get(one)
            or "the run recommended below")


def _menu(answer):
    """Table of the experiments that were simulated with every remaining cause."""
    advice = answer["next_experiment"]
    if not advice or max((row["least_distance"] for row in advice.get("menu") or ()),
                         default=0.0) < TELLS:
        return
    best = advice["best"]["experiment"]
    yield Table(
        ("next run", "causes left after it, expected", "evidence between the nearest two, chi^2"),
        tuple((row["experiment"], number(row["expected_set_size"]),
               number(row["least_distance"])) for row in advice["menu"]),
        "Simulated with each remaining cause; the marked run separates them best.",
        tuple("good" if row["experiment"] == best else "" for row in advice["menu"]))
