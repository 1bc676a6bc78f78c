"""An answer beside the truth: right cause, right joint, false attributions, sizes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

from clie_blocks.analysis.blind.scoring.decisions import NO_EFFECTS, Answer
from clie_blocks.analysis.real.outcome import Outcome, Quantity
from clie_blocks.analysis.real.truth import Run, Size
from clie_blocks.errors import RecordError, nearest

NAMED = 0.5  # probability from which on an effect is attributed to a robot
TOLERANCE = 0.1  # relative, of a value that no interval covers


@dataclasses.dataclass(frozen=True)
class SizeScore:
    """An independent value beside that of the answer; without one, None."""

    size: Size
    quantity: Quantity | None

    @property
    def is_right(self) -> bool:
        """Whether the answer is within 10 % of the range, or its interval meets it."""
        if self.quantity is None:
            return False
        low, high = sorted((self.size.low - TOLERANCE * abs(self.size.low),
                            self.size.high + TOLERANCE * abs(self.size.high)))
        meets = self.quantity.low <= self.size.high and self.size.low <= self.quantity.high
        return meets or low <= self.quantity.value <= high


@dataclasses.dataclass(frozen=True)
class Score:
    """How the answer on a run compares with the truth.

    Parameters
    ----------
    is_first : bool or None
        The effect that is put first is the cause; None where no cause is stated.
    is_joint : bool or None
        It acts where the cause does; None where the joint is not stated, or the cause not named.
    is_in_set : bool or None
        The 90 % set holds the cause.
    false : tuple of str
        Effects with half the probability that are not there, or at a joint that has none.
    sizes : tuple of SizeScore
        Independent values.

    """

    is_first: bool | None
    is_joint: bool | None
    is_in_set: bool | None
    false: tuple[str, ...]
    sizes: tuple[SizeScore, ...]


def score(run: Run, outcome: Outcome) -> Score:
    """Compare the answer on a run with what is true of it.

    Raises
    ------
    RecordError
        If the truth is of a joint that the robot does not have.

    """
    for name in (*run.joint, *run.control):
        if name not in outcome.joints:
            raise RecordError(f"{run.name}: the truth is of a joint {name!r} that the robot does "
                              f"not have; {nearest(name, outcome.joints)}")
    answer = Answer(_without(run.also, outcome.answer))
    decided = answer.names(answer.decision)
    is_first = bool(decided & set(run.cause)) if run.cause else None
    named = {outcome.joints[k - 1] for k in answer.joints.get(answer.decision, ())}
    is_joint = bool(named) and named <= set(run.joint) if is_first and run.joint else None
    is_in_set = _is_in_set(run.cause, answer) if run.cause else None
    return Score(is_first, is_joint, is_in_set, tuple(_false(run, answer, outcome.joints)),
                 tuple(SizeScore(size, outcome.quantities.get(size.parameter))
                       for size in run.size))


def _without(names: Sequence[str], answer: dict[str, Any]) -> dict[str, Any]:
    """An answer without effects that are there, but are not what is asked for."""
    return {**answer,
            "effects": [row for row in answer["effects"] if row["effect"] not in names],
            "set_90": [name for name in answer["set_90"] if name not in names]}


def _is_in_set(cause: Sequence[str], answer: Answer) -> bool:
    return any(answer.names(name) & set(cause) for name in answer.set_90)


def _false(run: Run, answer: Answer, joints: Sequence[str]) -> Iterable[str]:
    for name, probability in answer.probability.items():
        if probability < NAMED or name in NO_EFFECTS:
            continue
        at = sorted({joints[k - 1] for k in answer.joints[name]} & set(run.control))
        if name in run.absent or at:
            yield f"{name} at {', '.join(at)}" if at else name


def rate(flags: Iterable[bool | None]) -> dict[str, Any]:
    """Share of those that are judged."""
    judged = [flag for flag in flags if flag is not None]
    return {"right": sum(judged), "of": len(judged)}
