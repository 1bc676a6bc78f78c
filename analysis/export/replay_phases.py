"""Phases of a replayed log: how far what comes again and again has gone on when it begins."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy import optimize

from clie_blocks.analysis.export.events import Phase
from clie_blocks.analysis.export.simulated_model import SimulatedModel
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise

_TRIED = 12  # phases that are tried over a turn, of what acts all the time
_IN_ACTIVE = 2.0  # phases that are tried within the share of a turn in which it acts
_MOST_TRIED = 60
_RESOLUTION = 1e-3  # turns


@dataclasses.dataclass(frozen=True)
class Begins:
    """The phase of an effect in a log, against that of the first log of the diagnosis.

    Parameters
    ----------
    log, joint, effect : str
        The log, the joint, and the effect.
    turns : float
        By how much of a turn it is further at the start of the log, 0 to 1.

    """

    log: str
    joint: str
    effect: str
    turns: float

    def __str__(self) -> str:
        return (f"{self.effect} at {self.joint} begins {self.turns:.3f} turns further in "
                f"{self.log} than in the first log of the diagnosis, by the motion of that log")


def seek_phases(model: SimulatedModel, log: Log, own: Mapping[tuple[str, str], float],
                ) -> list[float]:
    """Return by how many turns each phase of a model is further in a log [0 to 1].

    One phase after the other is sought on a grid, and then around the best of that.  Where no
    phase is better than that of the first log by more than chance, it is 0.

    Parameters
    ----------
    model : SimulatedModel
        The corrected model.
    log : Log
        The log that it is to follow.
    own : dict
        What else is of this log alone, see `SimulatedModel.run`.

    """
    found: list[float] = []
    known = dict(own)
    for phase in model.phases:
        found.append(_sought(model, log, known, phase))
        known |= phase.later(found[-1])
    return found


def _sought(model: SimulatedModel, log: Log, own: Mapping[tuple[str, str], float], phase: Phase,
            ) -> float:
    k = model.problem.joints.index(phase.joint)

    def cost(turns: float) -> float:
        error = log.bridged(log.law_q - model.run(log, own={**own, **phase.later(turns)}))
        return float(np.sum(error[:, k] ** 2))

    count = int(np.clip(np.ceil(_IN_ACTIVE / max(phase.active, 1e-9)), _TRIED, _MOST_TRIED))
    tried = np.arange(count) / count
    costs = [cost(turns) for turns in tried]
    best = tried[int(np.argmin(costs))]
    fine = optimize.minimize_scalar(cost, method="bounded", options={"xatol": _RESOLUTION},
                                    bounds=(best - 1.0 / count, best + 1.0 / count))
    turns, least = min(((best, min(costs)), (fine.x, fine.fun)), key=lambda pair: pair[1])
    enough = METHOD.search.onset_gain * sensor_noise(model.problem, k) ** 2
    return float(turns % 1.0) if costs[0] - least > enough else 0.0
