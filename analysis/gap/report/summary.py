"""The verdict in words: one sentence for a line or a headline, and a summary of a few lines.

Everything is read from the JSON answer, so that a stored result reads like a fresh one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import wrap

from clie_blocks.analysis.gap.problem.locked_output import LOCKED
from clie_blocks.analysis.gap.report.cause_words import joint_names
from clie_blocks.analysis.gap.report.control_law import law_lines
from clie_blocks.analysis.gap.report.gap_sentences import (
    formula_sentence,
    gap_places,
    how_far,
    next_run,
    reductions,
    torque_map_sentence,
)
from clie_blocks.analysis.gap.report.verdict_sentence import or_the_file, verdict_sentence
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    effect_title,
    join_words,
    number,
)
from clie_blocks.output import WIDTH


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
            *or_the_file(answer), *_unfinished(answer), *locked_lines(answer),
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


def _not_shown(answer: Answer) -> list[str]:
    """How many names the logs could not have shown; as a list of one or none."""
    count = len(answer.get("not_shown", ()))
    return [f"{count} effects could not have shown in these logs; the report says why."
            ] if count else []


def _assumptions(answer: Answer) -> str:
    count = len(set(answer.get("decisions", ())) | set(answer.get("log_decisions", ())))
    return "No assumptions were needed." if not count else (
        f"{count} assumption{'s' if count > 1 else ''} made while reading and diagnosing; the "
        "report lists them.")
