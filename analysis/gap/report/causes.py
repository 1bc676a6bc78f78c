"""Which effect: ranked causes, and those that these logs cannot tell apart."""

from __future__ import annotations

from collections.abc import Iterator

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.cause_words import confounded, joint_names
from clie_blocks.analysis.gap.report.plots import probabilities, residuals
from clie_blocks.analysis.gap.report.wording import (
    CONFOUNDERS,
    Answer,
    Units,
    effect_title,
    join_words,
    number,
    percent,
)
from clie_blocks.analysis.gap.verdict.confounders import CONTACT, POSE, UNMARKED
from clie_blocks.analysis.report.document import Picture, Section, Table
from clie_blocks.effects import LIBRARY

SHOWN = 8
NO_RUN = " No experiment that was simulated would separate them: with these parameters their "  \
    "models move alike."
NO_RUN_BESIDE_UNKNOWN = " No experiment is recommended while something unknown remains: no "  \
    "model says how far it would move the robot."
IN_GENERAL = ", where their numbers differ more"
MARKS = ((0.5, "good"), (0.05, "unsure"))
SURE = 0.9  # probability of a cause that is established, whatever the others are
SEPARATED_BY = {
    CONTACT: "the effect sets in at a position that the robot passes at no other time, so contact "
             "with an obstacle moves it alike. A run that returns to that position and leaves it "
             "again separates them",
    UNMARKED: "the logs do not show the mark by which the effect is known (a model that is right "
              "until a fault sets in or a limit is met, a weight that the links may have, "
              "friction that still drifts after the start), so it may have absorbed a part of "
              "anything. A longer run that moves all joints separates them",
    POSE: "over this range of motion they, and any other torque that depends on the "
               "position, move the robot alike. A run over a wider range separates them"}


def causes_section(result: Result, answer: Answer, units: Units) -> Section:
    """Ranked causes with their probabilities; the residuals, where nothing explains them."""
    rows = answer["effects"][:SHOWN]
    names = joint_names(answer)
    table = Table(
        ("cause", "joint", "probability", "how it shows"),
        tuple((effect_title(row["effect"]),
               join_words(names[k - 1] for k in row["joint"] or ()) or "-",
               percent(row["probability"]), _signature(row["effect"])) for row in rows),
        marks=tuple(_mark(row["probability"]) for row in rows))
    text = ("Probability that a cause is present, summed over all combinations of causes that "
            "contain it; the probabilities of several causes can therefore add up to more than "
            "100 %. A smaller gap alone does not prove a cause.")
    pictures = [Picture("causes", probabilities(rows), "Probability of each cause.")]
    if answer["verdict"] == "unexplained":
        pictures.append(Picture("left", residuals(result, units),
                                "Residual of the best model at the joint with the largest error, "
                                "against velocity, position, command, time and frequency. A "
                                "pattern in one panel hints at the cause."))
    return Section("Which effect causes it", (text,), tables=(table,), pictures=tuple(pictures))


def _mark(probability: float) -> str:
    return next((mark for least, mark in MARKS if probability >= least), "")


def _signature(name: str) -> str:
    return LIBRARY[name].signature if name in LIBRARY else "-"


def alternatives_section(answer: Answer) -> Section:
    """Causes that these logs cannot tell apart, and the experiment that could."""
    sure = {row["effect"] for row in answer["effects"] if row["probability"] >= SURE}
    remaining = [name for name in answer["set_90"] if name in LIBRARY and name not in sure]
    mended = (f"{sentence}." for sentence in answer.get("advice", ()))
    confounders = (*mended, *_confounders(answer))
    menu = tuple(_menu(answer))
    if len(remaining) < 2:
        return Section("Alternative causes", (_single(answer),), tables=menu,
                       points=(*confounders, *_confusions(answer)))
    certain = join_words(effect_title(name) for name in answer["set_90"] if name in sure)
    given = f", given {certain}" if certain else ""
    text = (f"These logs cannot separate {join_words(map(effect_title, remaining))}: together "
            f"they hold at least 90 % of the probability{given}.")
    without_run = NO_RUN_BESIDE_UNKNOWN if "unknown" in answer["set_90"] else NO_RUN
    return Section("Alternative causes", (text if menu else text + without_run,),
                   tables=(Table(("causes", f"what separates them{'' if menu else IN_GENERAL}"),
                                 _separations(remaining, bool(menu))),
                           *menu),
                   points=confounders)


def _single(answer: Answer) -> str:
    if answer.get("next_experiment"):
        rivals = (" with ".join(map(effect_title, names))
                  for names in answer["next_experiment"]["separates"])
        return (f"These logs cannot separate {join_words(rivals, 'from')}. A log of the "
                "experiment recommended below can.")
    if answer["verdict"] != "effect":
        return "No two causes of the library compete for this gap."
    return ("One answer holds more than 90 % of the probability. The following causes look "
            "similar in general; the experiments named here rule them out for good.")


def _confounders(answer: Answer) -> Iterator[str]:
    """What outside the library would move the robot just as a cause in the answer does."""
    for row in confounded(answer):
        name = row["rival"]
        yield f"{effect_title(row['effect'])} or {CONFOUNDERS[name]}: {SEPARATED_BY[name]}."


def _confusions(answer: Answer) -> Iterator[str]:
    for name in answer["set_90"]:
        if name in LIBRARY:
            for other, experiment in LIBRARY[name].confused_with.items():
                yield f"{effect_title(name)} or {effect_title(other)}: {experiment}."


def _separations(names: list[str], is_advised: bool) -> tuple[tuple[str, str], ...]:
    """Experiment that separates each pair of causes, where the library names one."""
    pairs = [(one, other) for i, one in enumerate(names) for other in names[i + 1:]]
    named = [(f"{effect_title(one)} or {effect_title(other)}", _experiment(one, other))
             for one, other in pairs if _experiment(one, other)]
    if len(named) == len(pairs):
        return tuple(named)
    rest = "all other pairs" if named else join_words(map(effect_title, names), "or")
    return (*named, (rest, "the experiment recommended below" if is_advised
                     else "none of the experiments that were simulated"))


def _experiment(one: str, other: str) -> str:
    return LIBRARY[one].confused_with.get(other) or LIBRARY[other].confused_with.get(one, "")


def _menu(answer: Answer) -> Iterator[Table]:
    """Table of the experiments that were simulated with every remaining cause."""
    plan = answer.get("next_experiment")
    if not plan:
        return
    best = plan["best"]["experiment"]
    yield Table(
        ("next experiment", "expected size of the 90 % set", "chi^2 between the closest two"),
        tuple((row["experiment"], number(row["expected_set_size"]),
               number(row["least_distance"])) for row in plan["menu"]),
        "Simulated with each remaining cause; the marked experiment separates them best. Diagnose "
        "its log with the others, and name one of these by --holdout: the last is not fitted.",
        tuple("good" if row["experiment"] == best else "" for row in plan["menu"]))
