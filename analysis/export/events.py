"""Events: what set in at a moment of one log, and from which moment on a model has it.

A moment is of a log, not of the robot: exported, a fault is there from the start, as the robot is
now.  `MOMENTS` names the parameter that says when, for a run in which it is to come later.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.effects.effect import Setting

MOMENTS = {"step_fault": "time"}  # parameter [s] by the name of the effect
NEVER = 1e6  # s, for a run in which it does not come


@dataclasses.dataclass(frozen=True)
class Event:
    """What set in at a joint in the first log of the diagnosis.

    Parameters
    ----------
    joint : int
        The joint, from 0.
    parameter : str
        Of the block, such as ``step_fault.time``.
    time : float
        When, in that log [s]; `NEVER` where that log does not show it.

    """

    joint: int
    parameter: str
    time: float

    def note(self, name: str) -> str:
        """What the user of a model must know, by the name of the joint."""
        when = f"at {self.time:.4g} s of" if self.time < NEVER else "in a log after"
        return (f"{self.parameter.partition('.')[0]} at {name} set in {when} the first log. The "
                f"model has it from the start, as the robot has now; the parameter "
                f"{self.parameter} [s from the start of a run] lets it come later.")


def from_the_start(settings: Sequence[Setting], n: int,
                   ) -> tuple[tuple[Setting, ...], tuple[Event, ...]]:
    """Return effects without the moments of one log, and those as events.

    Parameters
    ----------
    settings : sequence of Setting
        Effects of a robot, with the moments of its first log.
    n : int
        Joints of the robot.

    """
    found, events = [], []
    for one in settings:
        moment = MOMENTS.get(one.effect.name)
        if moment:
            vectors = one.vectors(n)
            sizes = [vectors[p.name] for p in one.effect.parameters if p.neutral is not None]
            events += [Event(k, f"{one.name}.{moment}", float(vectors[moment][k]))
                       for k in range(n) if any(size[k] for size in sizes)]
            one = Setting(one.effect, {**one.values, moment: np.zeros(n)}, one.joints, one.name)
        found.append(one)
    return tuple(found), tuple(events)


def event_parameters(settings: Sequence[Setting]) -> list[str]:
    """Parameters of the block of a joint that say when something sets in."""
    return [f"{one.name}.{MOMENTS[one.effect.name]}" for one in settings
            if one.effect.name in MOMENTS]
