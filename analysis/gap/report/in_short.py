"""What one tells a colleague beside the verdict: where, how sure, what it buys, what next."""

from __future__ import annotations

from collections.abc import Iterator

from clie_blocks.analysis.gap.report.cause_words import together
from clie_blocks.analysis.gap.report.gap_sentences import (
    formula_sentence,
    gap_shares,
    how_far,
    next_run,
    torque_map_sentence,
)
from clie_blocks.analysis.gap.report.wording import Answer, effect_title, join_words, percent


def in_short(answer: Answer) -> tuple[tuple[str, str], ...]:
    """Return the questions of a reader with their answers, in the order of asking.

    Parameters
    ----------
    answer : dict
        The JSON answer.

    """
    buys = " ".join([how_far(answer), *torque_map_sentence(answer), *formula_sentence(answer)])
    sentences = (("Where", _where(answer)), ("How sure", _how_sure(answer)),
                 ("What it buys", buys), ("What to do next", " ".join(_what_next(answer))))
    return tuple((question, text) for question, text in sentences if text)


def _where(answer: Answer) -> str:
    if answer["verdict"] == "none":
        return ""
    parts = gap_shares(answer)
    text = "; ".join(f"{words} {parts[kind]}" for kind, words in (
        ("joint", "at"), ("block", "in the loop below in"), ("cause", "by cause"))
        if parts[kind])
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _how_sure(answer: Answer) -> str:
    """Probability of each name in the 90 % set."""
    found = {row["effect"]: row["probability"] for row in answer["effects"]}
    listed = [f"{effect_title(name)} {percent(found[name])}" for name in answer["set_90"]
              if name in found]
    if len(listed) < 2:
        return (f"{join_words(listed)}; all else together holds less than 10 % of the "
                "probability." if listed else "")
    alike = next((row for row in answer["effects"] if set(answer["set_90"]) <= {
        row["effect"], *row.get("alike", ())}), None)
    if alike is not None:
        return (f"{join_words(listed)}, together {percent(together(alike))}: these logs do not "
                "tell them apart.")
    return f"{join_words(listed)}: together they hold at least 90 % of the probability."


def _what_next(answer: Answer) -> Iterator[str]:
    yield from (f"First: {advice}." for advice in answer.get("advice", ()))
    yield from next_run(answer)
    verdict = answer["verdict"]
    if verdict == "none":
        yield "Nothing: the model may be used as it is."
    elif verdict == "parametric":
        yield "Correct the numbers of the robot file and of the simulator."
    elif verdict == "effect":
        yield ("Put the parameters below into your simulator, and run a motion there that was "
               "not used here.")
