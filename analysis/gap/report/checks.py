"""What the diagnosis stands on: checks of the log, and every decision that was taken."""

from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.assessment.gap_reduction import HELD_OUT
from clie_blocks.analysis.gap.report.wording import join_words, number, percent, with_prefix
from clie_blocks.analysis.report.document import Section, Table

AT_LIMIT = 0.999
MUCH = 0.01  # share of samples at the limit from which it matters


def saturated_share(diagnosis):
    """Share of the samples in which the command stands at its stated limit, per joint."""
    problem = diagnosis.problem
    u = np.concatenate([log.u for log in problem.logs])
    return np.mean(np.abs(u) >= AT_LIMIT * problem.law.saturation, axis=0)


def checks_section(diagnosis, units):
    """Controller replay, limits, encoder steps, noise."""
    check, problem = diagnosis.check, diagnosis.problem
    limited = saturated_share(diagnosis)
    rows, marks = [], []
    for k, joint in enumerate(problem.joints):
        replayed = check.replay_error[k] <= check.limit[k]
        rows.append((
            joint, f"{with_prefix(check.replay_error[k], units['u'])} "
            f"({'rounding alone' if replayed else 'more than rounding'})",
            percent(limited[k]), with_prefix(check.step[k], units["q"]),
            with_prefix(diagnosis.bench.noises[k].sigma, units["q"])))
        marks.append("good" if replayed and limited[k] < MUCH else "unsure")
    table = Table(("joint", "stated law against logged command", "samples at the limit",
                   "smallest step of the position", "sensor noise"),
                  tuple(rows), marks=tuple(marks))
    return Section("Checks", points=tuple(_remarks(diagnosis, limited)), tables=(table,))


def _remarks(diagnosis, limited):
    check, joints = diagnosis.check, diagnosis.problem.joints
    much = [joints[k] for k in np.flatnonzero(limited > MUCH)]
    if much:
        yield (f"The command of {join_words(much)} stands at its limit for up to "
               f"{percent(limited.max())} of the time: there the loop is open, and small errors "
               "of the model grow.")
    if check.wrong:
        wrong = join_words(joints[k] for k in check.wrong)
        yield (f"The stated velocity filter did not run at {wrong}: mend the robot file first.")
    if check.gains:
        gains = join_words(joints[k] for k in check.gains)
        yield f"The stated gains did not run at {gains}: mend the robot file first."
    if any(check.integral):
        drawn = join_words(joints[k] for k in np.flatnonzero(check.integral))
        yield f"The law of {drawn} has an integral part: say so, or switch it off for the logs."
    if check.late:
        yield "The command is sent one period after it was worked out: say so in the robot file."
    if check.coarse:
        coarse = join_words(joints[k] for k in check.coarse)
        yield f"The encoder of {coarse} is coarser than stated."
    unseen = ", ".join(Path(log.name).name for log in diagnosis.problem.held_out)
    judged = diagnosis.shrinkage.judged_on
    yield f"Judged on {unseen if judged == HELD_OUT else judged}."
    yield f"The diagnosis took {number(diagnosis.seconds)} s."


def decisions_section(diagnosis, records):
    """Everything that was decided on the way, by the reader of the logs and by the diagnosis."""
    said = dict.fromkeys([*(sentence for record in records for sentence in record.decisions),
                          *diagnosis.check.decisions])
    return Section("Decisions", ("Every guess that was taken on the way.",) if said
                   else ("No guess had to be taken.",), points=tuple(said))
