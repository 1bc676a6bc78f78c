"""What the diagnosis rests on: checks of the logs, and every assumption that was made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.gap_reduction import HELD_OUT
from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.report.wording import (
    Answer,
    Units,
    effect_title,
    join_words,
    number,
    percent,
    with_prefix,
)
from clie_blocks.analysis.report.document import Section, Table

AT_LIMIT = 0.999
MUCH = 0.01  # share of samples at the limit from which it matters


def saturated_share(result: Result) -> np.ndarray:
    """Share of the samples in which the command is at its stated limit, shape (n,)."""
    problem = result.problem
    u = np.concatenate([log.u for log in problem.logs])
    return np.mean(np.abs(u) >= AT_LIMIT * problem.law.saturation, axis=0)


def checks_section(result: Result, units: Units) -> Section:
    """Controller replay, limits, encoder steps, noise."""
    check, problem = result.controller, result.problem
    limited = saturated_share(result)
    rows, marks = [], []
    for k, joint in enumerate(problem.joints):
        replayed = check.replay_error[k] <= check.limit[k]
        rows.append((
            joint, f"{with_prefix(check.replay_error[k], units['u'])} "
            f"({'within rounding' if replayed else 'more than rounding'})",
            percent(limited[k]), with_prefix(check.step[k], units["q"]),
            with_prefix(result.residuals.noises[k].sigma, units["q"])))
        marks.append("good" if replayed and limited[k] < MUCH else "unsure")
    table = Table(("joint", "logged command less that of the stated law, RMS",
                   "samples at the command limit", "smallest step of the position",
                   "sensor noise"), tuple(rows), marks=tuple(marks))
    return Section("Checks", points=(*map(str, result.problem.corrections),
                                     *map(str, result.problem.log_warnings),
                                     *_remarks(result, limited)), tables=(table,))


def _remarks(result: Result, limited: np.ndarray) -> Iterator[str]:
    check, joints = result.controller, result.problem.joints
    much = [joints[k] for k in np.flatnonzero(limited > MUCH)]
    if much:
        yield (f"The command of {join_words(much)} is at its limit for up to "
               f"{percent(limited.max())} of the time: the loop is open there, and small model "
               "errors grow.")
    if check.other_filter:
        wrong = join_words(joints[k] for k in check.other_filter)
        yield (f"The velocity filter that ran at {wrong} is not the stated one: correct the robot "
               "file first.")
    if check.other_gains:
        gains = join_words(joints[k] for k in check.other_gains)
        yield (f"The gains that ran at {gains} are not the stated ones: correct the robot file "
               "first.")
    if check.parameters:
        names = join_words(dict.fromkeys(one.name for one in check.parameters))
        yield f"The law ran with another {names} than stated: correct the description first."
    if any(check.integral):
        integral = join_words(joints[k] for k in np.flatnonzero(check.integral))
        yield (f"The control law of {integral} has an integral part: state it in the robot file, "
               "or switch it off while logging.")
    if check.delayed:
        yield ("The command is sent one period after it was computed: state this in the robot "
               "file.")
    if check.coarse:
        coarse = join_words(joints[k] for k in check.coarse)
        yield f"The encoder of {coarse} has a coarser resolution than stated."
    held_out = ", ".join(Path(log.name).name for log in result.problem.held_out)
    judged = result.reduction.judged_on
    yield f"Validated on {held_out if judged == HELD_OUT else judged}."
    yield f"The diagnosis took {number(result.seconds)} s."


def not_shown_section(answer: Answer) -> Section | None:
    """Names that these logs could not have shown, by reason; None where there are none."""
    by_reason: dict[str, list[str]] = {}
    for row in answer["not_shown"]:
        by_reason.setdefault(row["why"], []).append(effect_title(row["effect"]))
    if not by_reason:
        return None
    return Section("What these logs do not show", (
        "These effects may be there all the same: nothing in the logs could have shown them.",),
        tables=(Table(("effects", "why not"), tuple(
            (join_words(names), why) for why, names in by_reason.items())),))


def assumptions_section(answer: Answer) -> Section:
    """Everything that was assumed by the reader of the logs and by the diagnosis."""
    assumptions = tuple(dict.fromkeys([*answer["log_decisions"], *answer["decisions"]]))
    return Section("Assumptions", (
        "Assumptions made while reading and diagnosing." if assumptions
        else "No assumptions were needed.",), points=assumptions)


def thresholds_section(result: Result) -> Section:
    """Every threshold of the method, for whoever wants to know why the verdict is what it is."""
    rows = tuple((one.name, _value(one.value), one.unit, one.reason)
                 for one in result.method.thresholds())
    return Section("Thresholds of the method", (
        "The verdict follows from the logs and from these values. They were set on other robots "
        "than those of the published blind trials.",),
        tables=(Table(("name", "value", "unit", "reason"), rows),), collapsed=True)


def _value(value: Any) -> str:
    """A threshold as text: one number, several, or names."""
    if isinstance(value, (tuple, list, set, frozenset)):
        items = sorted(value) if isinstance(value, (set, frozenset)) else value
        return ", ".join(map(_value, items))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
