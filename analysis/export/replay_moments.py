"""Moments of a replayed log: when a fault of the corrected model sets in there."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.export.events import NEVER
from clie_blocks.analysis.export.simulated_model import SimulatedModel
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise

_EITHER_SIDE = 5  # moments that are tried on either side of one, at each spacing


@dataclasses.dataclass(frozen=True)
class SetIn:
    """A fault of the corrected model, and the moment at which a log shows it.

    Parameters
    ----------
    log, joint, parameter : str
        The log, the joint, and the parameter of its block that says when.
    time : float
        From the start of the log [s]: 0 where the whole log shows it, `NEVER` where none does.

    """

    log: str
    joint: str
    parameter: str
    time: float

    def __str__(self) -> str:
        fault = self.parameter.partition(".")[0]
        when = (f"sets in at {self.time:.4g} s of" if 0.0 < self.time < NEVER else
                "does not show in" if self.time else "is there from the start of")
        return f"{fault} at {self.joint} {when} {self.log}, by the motion of that log"


def seek_moments(model: SimulatedModel, log: Log) -> list[float]:
    """Return the moment of each event of a model at which it is closest to a log [s].

    Two runs, one with the fault throughout and one without, show where the log goes over from one
    to the other; runs with the fault from about then on find the moment.

    Parameters
    ----------
    model : SimulatedModel
        The corrected model.
    log : Log
        The log that it is to follow.

    """
    def squares(moments: Sequence[float]) -> np.ndarray:
        error = log.bridged(log.law_q - model.run(
            log, own=dict(zip(events, moments, strict=True))))
        return np.asarray(error**2)

    events = model.events
    if not events:
        return []
    joints = [model.problem.joints.index(name) for name, _ in events]
    without, throughout = (squares([moment] * len(events)) for moment in (NEVER, 0.0))
    found = [_change(without[:, k], throughout[:, k], model.problem.period,
                     METHOD.search.onset_gain * sensor_noise(model.problem, k) ** 2)
             for k in joints]
    for place, k in enumerate(joints):
        if 0.0 < found[place] < NEVER:
            def cost(moment: float, at: int = place, joint: int = k) -> float:
                return float(squares([*found[:at], moment, *found[at + 1:]])[:, joint].sum())

            found[place] = _refined(cost, found[place])
    return found


def _refined(cost: Callable[[float], float], moment: float) -> float:
    """Moment of the least cost near one that is known roughly [s].

    The cost has several valleys, by what the joint does at the moment, so it is sought on grids.
    """
    for spacing in METHOD.search.onset_refinements:
        tried = np.maximum(0.0, moment + spacing * np.arange(-_EITHER_SIDE, _EITHER_SIDE + 1))
        moment = float(min(np.unique(tried), key=cost))
    return moment


def _change(without: np.ndarray, throughout: np.ndarray, period: float, gain: float) -> float:
    """Moment from which on squares (N,) of the errors with a fault are the smaller ones [s].

    Within the log only where that is better by some gain than all of it, or none.
    """
    before, after = np.cumsum([0.0, *without]), np.cumsum([0.0, *throughout[::-1]])[::-1]
    whole = before + after
    best = int(np.argmin(whole))
    if whole[best] > min(whole[0], whole[-1]) - gain:
        return 0.0 if whole[0] <= whole[-1] else NEVER
    return best * period
