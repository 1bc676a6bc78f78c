"""What is of one log and not of the robot: moments at which faults set in, and phases.

Exported, a fault is there from the start, as the robot is now, and what comes again and again has
the phase of the first log.  The parameters that say so can be set for a run in which it is to be
otherwise: `MOMENTS` and `PHASES` name them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.effects.effect import Setting

MOMENTS = {"step_fault": "time"}  # parameter [s] by the name of the effect
NEVER = 1e6  # s, for a run in which it does not come
_SINE, _COSINE, _PHASE = "sine", "cosine", "phase"
PHASES = {"periodic_disturbance": (_SINE, _COSINE), "tick_jitter": (_PHASE,),
          "packet_hold": (_PHASE,)}  # parameters by the name of the effect


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
            events += [Event(k, f"{one.name}.{moment}", float(one.vectors(n)[moment][k]))
                       for k in range(n) if _acts(one, k, n)]
            one = Setting(one.effect, {**one.values, moment: np.zeros(n)}, one.joints, one.name)
        found.append(one)
    return tuple(found), tuple(events)


@dataclasses.dataclass(frozen=True)
class Phase:
    """The phase of what comes again and again at a joint, as a model has it.

    Parameters
    ----------
    joint, name : str
        Names of the joint and of the effect.
    values : dict
        Of the parameters that hold the phase, by their names in the effect.
    active : float
        Share of a turn in which it does something.

    """

    joint: str
    name: str
    values: Mapping[str, float]
    active: float = 1.0

    @property
    def note(self) -> str:
        """What the user of a model must know."""
        keys = " and ".join(f"{self.name}.{key}" for key in self.values)
        return (f"{self.name} at {self.joint} has the phase that it had at the start of the first "
                f"log; {keys} may be set for another. clie replay seeks it in each log.")

    def later(self, turns: float) -> dict[tuple[str, str], float]:
        """Values of parameters, by joint and name, of what has gone on for some turns more."""
        if _PHASE in self.values:
            changed = {_PHASE: (self.values[_PHASE] + turns) % 1.0}
        else:
            turned = (complex(self.values[_COSINE], -self.values[_SINE])
                      * np.exp(2j * np.pi * turns))
            changed = {_SINE: -float(turned.imag), _COSINE: float(turned.real)}
        return {(self.joint, f"{self.name}.{key}"): value for key, value in changed.items()}


def phases_of(settings: Sequence[Setting], joint: str, k: int, n: int) -> list[Phase]:
    """Return the phases of the effects of joint k of n, by its name."""
    found = []
    for one in settings:
        keys = PHASES.get(one.effect.name, ())
        if keys and _acts(one, k, n):
            value = {key: float(vector[k]) for key, vector in one.vectors(n).items()}
            active = value["hold"] / value["interval"] if "hold" in value else 1.0
            found.append(Phase(joint, one.name, {key: value[key] for key in keys},
                               min(active, 1.0)))
    return found


def _acts(setting: Setting, k: int, n: int) -> bool:
    """Whether an effect does something at joint k of n."""
    vectors = setting.vectors(n)
    return any(vectors[p.name][k] for p in setting.effect.parameters if p.neutral is not None)


def parameters_of_one_log(settings: Sequence[Setting]) -> list[tuple[str, str]]:
    """Parameters of the block of a joint that are of one log, each with what it says."""
    moments = [(f"{one.name}.{MOMENTS[one.effect.name]}",
                "when it sets in [s from the start]") for one in settings
               if one.effect.name in MOMENTS]
    return moments + [(f"{one.name}.{key}", "of the first log's phase") for one in settings
                      for key in PHASES.get(one.effect.name, ())]
