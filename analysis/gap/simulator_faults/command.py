"""``clie diagnose --simulated LOG... --model FILE``: what a simulator does wrong, in words."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

from clie_blocks.analysis.gap.batch import read_task
from clie_blocks.analysis.gap.report.wording import percent
from clie_blocks.analysis.gap.simulator_faults.model_file import read_model_file
from clie_blocks.analysis.gap.simulator_faults.stated_run import stated_run
from clie_blocks.analysis.gap.simulator_faults.suspect import Suspicion, suspect
from clie_blocks.analysis.gap.tasks import find_tasks
from clie_blocks.analysis.records.reading import Reading
from clie_blocks.errors import RecordError
from clie_blocks.output import wrapped

NO_OPTIONS = Reading()
MENTIONED = 0.05  # probability from which on another fault is mentioned


def suspect_paths(logs: Sequence[str | PathLike[str]], model: str | PathLike[str],
                  robot: str | PathLike[str] | None = None, reading: Reading = NO_OPTIONS,
                  ) -> Suspicion:
    """Find the fault that makes the logs of a simulator differ from what its files state.

    Parameters
    ----------
    logs : sequence of path-like
        Logs that the simulator made, or their folder.
    model : path-like
        The MJCF that it was to run.
    robot : path-like, optional
        Robot file with the control law that it was to run; by default the one beside the logs.
    reading : Reading
        How the logs are read.

    Raises
    ------
    RecordError
        If the logs are of several robots, or the model is not theirs.
    MissingExtraError
        If MuJoCo is not installed, by which the model is read.
    NotIdentifiableError
        If the robot file states no law.

    """
    tasks = find_tasks(logs, robot)
    if len(tasks) != 1:
        raise RecordError(f"{', '.join(map(str, logs))}: {len(tasks)} robots, and a simulator is "
                          "examined by the logs of one; name the logs of one")
    stated, records = read_task(tasks[0], reading)
    return suspect(stated_run(stated, records, read_model_file(model, stated.joints)))


def lines(answer: dict[str, Any]) -> list[str]:
    """Return an answer for a terminal, the verdict first.

    Parameters
    ----------
    answer : dict
        From `Suspicion.to_dict`.

    """
    model, gap, verdict = answer["model"], _milli(answer["gap"]), answer["verdict"]
    if verdict == "none":
        return [wrapped(f"{model}: The simulator runs what its files state, up to {gap}."),
                *(wrapped(f"Note: {note}.", "  ") for note in answer["notes"])]
    if verdict == "unknown":
        return [wrapped(f"{model}: The simulator differs from what its files state by {gap}, and "
                        "no known fault explains that."),
                *(wrapped(f"Closest: it {one['says']} ({percent(one['probability'])}).", "  ")
                  for one in answer["faults"][:2]),
                wrapped("Next: clie diagnose on the same logs, as if a robot had made them, "
                        "searches all effects.", "  ")]
    first, *others = answer["faults"]
    return [wrapped(f"{model}: The simulator {first['says']}{_where(first)} "
                    f"({percent(first['probability'])})."),
            wrapped(f"With this fault the files explain the logs up to {_milli(first['gap'])}, "
                    f"without it up to {gap}.", "  "),
            *(wrapped(_line(model, first, one), "  ") for one in first["lines"]),
            wrapped(f"To do: {first['mend']}.", "  "),
            *(wrapped(f"Or it {one['says']}{_where(one)} ({percent(one['probability'])}).", "  ")
              for one in others if one["probability"] >= MENTIONED)]


def _where(row: dict[str, Any]) -> str:
    step = "" if row["step"] is None else f", of {_milli(row['step'], 's')}"
    return step + (f" at {', '.join(row['joints'])}" if row["joints"] else "")


def _line(model: str, row: dict[str, Any], place: dict[str, Any]) -> str:
    attribute, value = row["attribute"], place["value"]
    held = f"no {attribute} is written there" if value is None else f'{attribute}="{value}"'
    return f"{model}:{place['line']}: <{place['element']}>, {held}"


def _milli(value: float, unit: str = "rad") -> str:
    return f"{1e3 * value:.2g} m{unit}"
