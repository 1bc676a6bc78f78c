"""The verdict in words: one sentence for a line or a headline, and a summary of a few lines.

Everything is read from the JSON answer, so that a stored result reads like a fresh one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from textwrap import wrap

from clie_blocks.analysis.gap.problem.locked_output import LOCKED
from clie_blocks.analysis.gap.report.control_law import law_lines
from clie_blocks.analysis.gap.report.wording import (
    CLOSED_LOOP,
    CONFOUNDERS,
    JOINT_PARAMETERS,
    RECORDED_COMMAND,
    WITH_OBSERVER,
    Answer,
    Row,
    effect_title,
    join_words,
    number,
    percent,
    with_prefix,
)
from clie_blocks.analysis.gap.verdict.posterior import (
    LIKELY,
    MODEL_DIVERGED,
    NONE,
    NOT_BORNE_OUT,
    PARAMETRIC,
    UNKNOWN,
)
from clie_blocks.effects import LIBRARY
from clie_blocks.output import WIDTH

SURE = 0.9  # probability from which on the family of an effect adds nothing
MENTIONED = 0.02  # probability of a cause whose confounder is reported
SHOWN_DEVIATIONS = 3  # parameters in a sentence
SHOWN_BLOCKS = 3
SMALL_SHARE = 0.01  # of the gap: blocks and joints below are left out
OF_FAMILY = {"friction": "friction of some kind", "load": "a load of some kind",
             "environment": "an external disturbance"}
VALIDATED_ON = {"held-out logs": "on logs that were not fitted",
                "blocks left out of the fit": "by cross-validation"}
JUDGED_BY = {RECORDED_COMMAND: ", with the recorded command",
             WITH_OBSERVER: ", with an observer, as no known controller holds the machine"}


def summary_line(name: str, answer: Answer) -> str:
    """Return one line: verdict, joints, probabilities, and what it removes."""
    return " ".join([f"{name}:", *_sentences(answer)])


def terminal_lines(name: str, answer: Answer, width: int = WIDTH) -> str:
    """Return the same for a terminal: the verdict first, each detail on lines of its own."""
    first, *details = _sentences(answer)
    lines = [wrap(f"{name}: {first}", width, subsequent_indent="  "),
             *(wrap(detail, width, initial_indent="  ", subsequent_indent="  ")
               for detail in details)]
    return "\n".join(line for part in lines for line in part)


def _sentences(answer: Answer) -> list[str]:
    """Corrections of the logs, verdict, reduction of the gap, and what else there is to say."""
    if "error" in answer:
        return ["not diagnosed"]
    if answer["verdict"] == LOCKED:
        return locked_lines(answer)
    corrected = " ".join(f"{row['what']} {row['done']}"
                         for row in answer.get("log", {}).get("corrections", ()))
    return [*([f"Corrected in the logs: {corrected}"] if corrected else []),
            *_headline(answer), *torque_map_sentence(answer), *formula_sentence(answer)]


def locked_lines(answer: Answer) -> list[str]:
    """Twist of the gears in logs whose output was locked, one line each."""
    return [f"Output locked, {row['joint']}: lost motion "
            f"{number(math.degrees(row['lost_motion']['value']))} deg "
            f"({_degrees(row['lost_motion']['interval'])} over {row['sweeps']} sweeps), "
            f"stiffness {number(row['stiffness']['value'][0])} N m/rad while the torque grows and "
            f"{number(row['stiffness']['value'][1])} while it falls; "
            f"{number(row['breakaway']['value'])} N m turn the motor through the lost motion."
            for row in answer.get("locked", ())]


def _degrees(interval: Sequence[float]) -> str:
    return " to ".join(number(math.degrees(end)) for end in interval)


def headline(answer: Answer) -> str:
    """Return the verdict and what the corrected model removes, as a sentence or two."""
    return " ".join(_headline(answer))


def _headline(answer: Answer) -> list[str]:
    return [*_law(answer), verdict_sentence(answer), *reductions(answer), *_unfinished(answer)]


def _law(answer: Answer) -> list[str]:
    """How the law that ran differs from the stated one, one line each."""
    return law_lines(answer, joint_names(answer))


def summary_lines(answer: Answer) -> list[str]:
    """Return the corrections of the logs, then at most eight lines: which cause, where, what next.

    Parameters
    ----------
    answer : dict
        The JSON answer.

    """
    return [*log_lines(answer), *_law(answer), verdict_sentence(answer),
            *_or_the_file(answer), *_unfinished(answer), *locked_lines(answer),
            *gap_places(answer), how_far(answer),
            f"90 % set: {join_words(map(effect_title, answer['set_90'])) or '-'}.",
            *torque_map_sentence(answer), *formula_sentence(answer), *_not_shown(answer),
            *(f"First: {advice}." for advice in answer.get("advice", ())),
            *next_run(answer), _assumptions(answer)]


def _unfinished(answer: Answer) -> list[str]:
    """That the budget ended the search, as a list of one or none."""
    return [] if answer.get("complete", True) else [
        "The time was over before the search was: allow more with --seconds."]


def log_lines(answer: Answer) -> list[str]:
    """What was corrected in the logs, one line each, and what could not be."""
    log = answer.get("log", {})
    names = list(dict.fromkeys(row["check"] for row in log.get("warnings", ())))
    return [*(f"Corrected in the logs: {row['what']} {row['done']} {row['why']}"
              for row in log.get("corrections", ())),
            *([f"Warnings of the logs, which 'clie check' explains: {', '.join(names)}."]
              if names else [])]


def joint_names(answer: Answer) -> list[str]:
    """Names of the joints; 'joint 1' and so on where the answer holds none."""
    rows = answer.get("where", {}).get("joint", ())
    return [row["name"] for row in rows] or [
        f"joint {k + 1}" for k in range(max(_joint_count(answer), 1))]


def _joint_count(answer: Answer) -> int:
    named = [k for row in answer.get("effects", ()) for k in row["joint"] or ()]
    return max([len(answer.get("noise", ())), *named], default=0)


def verdict_sentence(answer: Answer) -> str:
    """Return the verdict in one sentence: causes, joints, probabilities."""
    verdict = answer["verdict"]
    if verdict == "none":
        return "The model agrees with the robot down to the sensor noise."
    if verdict == "parametric":
        if answer.get("description"):
            return f"The numbers of robot.toml are off: {_numbers(answer)}."
        deviations = parameter_deviations(answer)
        return ("The model structure is right, but parameters are outside their tolerance"
                + (f": {'; '.join(deviations)}." if deviations else "."))
    if verdict == "not_identifiable":
        return f"These logs do not identify the cause: {_candidates(answer)}."
    if verdict == "unexplained":
        return _unexplained(answer)
    return f"The model is missing {_list(leading_rows(answer), answer)}."


def _numbers(answer: Answer) -> str:
    """Numbers that are off, in words: 'links.mass_kg of joint 2 is 0.62 kg, stated 0.5'."""
    joints = joint_names(answer)
    alternatives: dict[int, list[str]] = {}
    for row in answer.get("description", ()):
        alternatives.setdefault(row.get("alternative", 1), []).append(
            _wrong_number(row, joints[row["joint"] - 1]))
    said = ", or ".join(join_words(numbers) for numbers in alternatives.values())
    return said + (" (these logs do not tell them apart)" if len(alternatives) > 1 else "")


def _wrong_number(row: Row, joint: str) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    if row["key"] == "zero_rad":
        return (f"where the log of {joint} reads 0, the joint stands at "
                f"{number(row['identified'])}{unit}")
    return (f"{row['key']} of {joint} is {number(row['identified'])}{unit}, stated "
            f"{number(row['stated'])}" + (f" ({row['note']})" if row.get("note") else ""))


def _or_the_file(answer: Answer) -> list[str]:
    """Numbers of the robot file that would explain the gap as well; as a list of one or none."""
    rows = answer.get("description", ())
    if not rows or answer["verdict"] == PARAMETRIC:
        return []
    certain = rows[0]["probability"] >= LIKELY
    head = ("The numbers of robot.toml are off as well" if certain
            else f"Or the numbers of robot.toml are off ({percent(rows[0]['probability'])})")
    return [f"{head}: {_numbers(answer)}."]


def _unexplained(answer: Answer) -> str:
    for row in confounded(answer)[:1]:
        return (f"These logs cannot distinguish {CONFOUNDERS[row['rival']]} from "
                f"{_list([row], answer)}.")
    law = "" if answer.get("controller_as_stated", True) or answer.get("controller") else (
        ", and the stated control law is not the one that ran")
    if answer.get("reason") == MODEL_DIVERGED:
        return ("The model diverged on these logs, so that no effect can be told: check gains, "
                "units and control law in the robot file.")
    if answer.get("reason") == NOT_BORNE_OUT:
        return f"{_not_borne_out(answer)}{law}."
    sure = [row for row in answer["effects"]
            if row["probability"] >= LIKELY and row["effect"] not in (NONE, UNKNOWN)]
    also = f" The model is also missing {_list(sure, answer)}." if sure else ""
    return f"No effect in the library explains the gap{law}.{also}"


def _not_borne_out(answer: Answer) -> str:
    """Why the closest effect is not named."""
    closest = join_words(_at_joints(row, answer) for row in answer["closest"])
    return (f"No effect in the library explains the gap: {closest} would fit these logs best, but "
            "does not predict unseen data clearly better than the refitted nominal model")


def leading_rows(answer: Answer) -> list[Row]:
    """Rows of the causes that are likely, or of the most likely one alone."""
    rows = [row for row in answer["effects"] if row["effect"] not in (NONE, UNKNOWN, PARAMETRIC)]
    likely: list[Row] = []
    for row in rows:
        stands_for = {*row.get("alike", ()), row["effect"]}
        if (together(row) >= LIKELY
                and not stands_for & {leading["effect"] for leading in likely}):
            likely.append(row)
    return likely or rows[:1]


def together(row: Row) -> float:
    """Probability of an effect or of one that the logs do not tell from it."""
    return float(row.get("together", row["probability"]))


def _list(rows: Iterable[Row], answer: Answer) -> str:
    return join_words(_listed(row, answer) for row in rows)


def _listed(row: Row, answer: Answer) -> str:
    """An effect, its joints and its probability; and what these logs do not tell it from."""
    alike = row.get("alike", ())
    if alike:
        return (f"{join_words([_at_joints(row, answer), *map(effect_title, alike)], 'or')} "
                f"({percent(together(row))}; these logs do not tell them apart)")
    return (f"{_at_joints(row, answer)} ({percent(row['probability'])}"
            f"{_family_clause(answer, row)})")


def _at_joints(row: Row, answer: Answer) -> str:
    """An effect and its joints; without joints where it is one of the whole robot."""
    names = joint_names(answer)
    joints = join_words(names[k - 1] for k in row["joint"] or ())
    return effect_title(row["effect"]) + (f" at {joints}" if joints else "")


def _family_clause(answer: Answer, row: Row) -> str:
    """How sure the family of an effect is, where the effect itself is not."""
    family = family_probability(answer, row)
    return f"; {family[0]} {percent(family[1])}" if family else ""


def _candidates(answer: Answer) -> str:
    """What is left where no effect is likely: the family that is, or all names."""
    leading = leading_rows(answer)
    if leading and leading[0].get("alike"):
        return _list(leading[:1], answer)
    likely = likely_family(answer, LIKELY)
    if not likely:
        return join_words(map(effect_title, answer["set_90"]), "or")
    family, probability, row = likely
    return (f"{family_title(family)} ({percent(probability)}), most likely "
            f"{_at_joints(row, answer)} ({percent(row['probability'])})")


def confounded(answer: Answer) -> list[Row]:
    """Rows of the causes that a confounder outside the library would explain as well."""
    return [row for row in answer["effects"]
            if row.get("rival") and row["probability"] >= MENTIONED]


def family_title(family: str) -> str:
    """A family of effects for a reader, where it is not known which of them it is."""
    return OF_FAMILY.get(family, f"a {family} effect")


def likely_family(answer: Answer, least: float) -> tuple[str, float, Row] | None:
    """Most likely family, its probability and the row of its most likely effect.

    None where no family has the probability `least`, or an effect of another family is as likely.
    """
    first, rows = _first_family(answer, least), _of_library(answer)
    return first if first and first[2] is rows[0] else None


def _first_family(answer: Answer, least: float) -> tuple[str, float, Row] | None:
    family, probability = next(iter(answer.get("families", {}).items()), ("", 0.0))
    if probability < least:
        return None
    return family, probability, next(row for row in _of_library(answer)
                                     if LIBRARY[row["effect"]].family == family)


def _of_library(answer: Answer) -> list[Row]:
    return [row for row in answer["effects"] if row["effect"] in LIBRARY]


def family_probability(answer: Answer, row: Row) -> tuple[str, float] | None:
    """Title and probability of an effect's family, where that is sure and the effect is not."""
    likely = _first_family(answer, SURE)
    if likely is None or likely[2] is not row or row["probability"] >= SURE:
        return None
    return family_title(likely[0]), likely[1]


def parameter_deviations(answer: Answer) -> list[str]:
    """Joint parameters beyond what the datasheet allows, in words, worst first."""
    deviations, joints = [], joint_names(answer)
    for name, entry in answer.get("joint_model", {}).items():
        rows = zip(joints, *(entry[key] for key in ("value", "stated", "tolerance")))
        deviations += [
            (abs(value - stated) / tolerance,
             f"{JOINT_PARAMETERS.get(name, name)} at {joint} {number(value)} {entry['unit']}, "
             f"stated {number(stated)}")
            for joint, value, stated, tolerance in rows if abs(value - stated) > tolerance > 0.0]
    worst = [text for _, text in sorted(deviations, reverse=True)]
    return worst[:SHOWN_DEVIATIONS] + (
        [f"{len(worst) - SHOWN_DEVIATIONS} more"] if len(worst) > SHOWN_DEVIATIONS else [])


def reductions(answer: Answer) -> list[str]:
    """What the corrected model removes, where a cause was added; as a list of one or none."""
    closed = answer["closed_percent"]
    if closed["value"] is None or answer["verdict"] in (NONE, PARAMETRIC):
        return []
    data = "unseen data" if closed["unseen_data"] else "the data used for the fit"
    share = f"{abs(closed['value']):.0f} %"
    if closed["value"] < 0.0:
        return [f"{_correction(answer)} enlarges the reducible gap by {share} on {data}."]
    return [f"{_correction(answer)} removes {share} of the reducible gap on {data}."]


def _correction(answer: Answer) -> str:
    """What is added to the model, as the subject of a sentence."""
    if answer["verdict"] == "not_identifiable":
        return "Adding the most likely cause"
    if answer["verdict"] == "unexplained":
        return ("Adding the closest effect" if answer.get("controller_as_stated", True)
                else "Replacing the control law by the one that ran")
    return "Adding it" if len(leading_rows(answer)) == 1 else "Adding them"


def gap_places(answer: Answer) -> list[str]:
    """Shares by cause, by block and by joint, largest first; as a list of one or none."""
    text = "; ".join(f"by {kind} {shares}" for kind, shares in gap_shares(answer).items()
                     if shares)
    return [f"Where the gap lies: {text}."] if text else []


def gap_shares(answer: Answer) -> dict[str, str]:
    """Shares by cause, block and joint in words, largest first; empty where there is none."""
    where = answer.get("where", {})
    return {"cause": _shares((row["share"]["mean"], effect_title(row["effect"]))
                             for row in answer["effects"] if row.get("share")),
            "block": _shares((row["share"], row["block"]) for row in where.get("block", ())),
            "joint": _shares((row["share"], row["name"]) for row in where.get("joint", ()))}


def _shares(pairs: Iterable[tuple[float, str]]) -> str:
    ranked = sorted(pairs, key=lambda pair: -pair[0])[:SHOWN_BLOCKS]
    return ", ".join(f"{name} {percent(share)}" for share, name in ranked if share > SMALL_SHARE)


def how_far(answer: Answer) -> str:
    """Prediction error before and after, its floor, and the share that is removed."""
    noise: Sequence[Row] = answer.get("noise", ())
    unit = noise[0]["unit"] if noise else "rad"
    before, after, floor = (with_prefix(answer[key], unit)
                            for key in ("gap_before", "gap_after", "gap_floor"))
    closed = answer["closed_percent"]
    removed = "no reducible gap"
    if closed["value"] is not None:
        interval = closed["interval"]
        span = f" ({number(interval[0])} to {number(interval[1])} %)" if interval else ""
        removed = f"{number(closed['value'])} %{span} of the reducible gap removed"
    data = VALIDATED_ON.get(closed["judged_on"], "on the fitted log itself")
    data += JUDGED_BY.get(closed.get("judged_by", CLOSED_LOOP), "")
    return (f"RMS prediction error: {before} before, {after} after, {floor} from sensor noise "
            f"alone; {removed}, {data}.")


def torque_map_sentence(answer: Answer) -> list[str]:
    """What a torque map removes beyond the causes; as a list of one or none."""
    table = answer.get("repeatable")
    if table is None:
        return []
    causes = join_words(map(effect_title, table["beside"])) or "the refitted nominal model"
    return [f"A torque map over position and velocity, added to {causes}, removes "
            f"{table['percent']:.0f} % of the remaining reducible gap."]


def formula_sentence(answer: Answer) -> list[str]:
    """What a formula without a name removes beyond the causes; as a list of one or none."""
    formula = answer.get("formula")
    if formula is None:
        return []
    causes = join_words(map(effect_title, formula["beside"])) or "the refitted nominal model"
    count = len(formula["terms"])
    exported = "" if formula["beside"] else "; 'clie export' writes it"
    return [f"A formula of {count} term{'s' if count > 1 else ''} that names no cause, added to "
            f"{causes}, removes {formula['percent']:.0f} % of the remaining reducible gap on "
            f"unseen data{exported}."]


def _not_shown(answer: Answer) -> list[str]:
    """How many names the logs could not have shown; as a list of one or none."""
    count = len(answer.get("not_shown", ()))
    return [f"{count} effects could not have shown in these logs; the report says why."
            ] if count else []


def next_run(answer: Answer) -> list[str]:
    """The recommended experiment and what it separates; as a list of one or none."""
    experiment = answer.get("next_experiment")
    if not experiment:
        return []
    causes = join_words((" with ".join(map(effect_title, names))
                         for names in experiment["separates"]), "from")
    return [f"Next experiment: {experiment['best']['experiment']}; separates {causes}."]


def _assumptions(answer: Answer) -> str:
    count = len(set(answer.get("decisions", ())) | set(answer.get("log_decisions", ())))
    return "No assumptions were needed." if not count else (
        f"{count} assumption{'s' if count > 1 else ''} made while reading and diagnosing; the "
        "report lists them.")
