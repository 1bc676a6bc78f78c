"""The causes of the corrected model for others: names in simulators, effects for a diagram."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    from clie_blocks.effects.effect import Setting

SIMULATORS = ("mujoco", "gazebo", "isaac")


def simulator_names(effect: str) -> tuple[str, ...]:
    """Name and parameter of an effect in MuJoCo, URDF or Gazebo, and Isaac; ``none`` without."""
    return tuple(LIBRARY[effect].simulators.get(name, "none") for name in SIMULATORS)


def settings(model: Fit, log: int = 0) -> list[Setting]:
    """Return the causes of a fitted model as effects of the catalogue, for `with_effects`.

    Numbers of the robot file that are off are no effects: they belong into the plant.

    Parameters
    ----------
    model : Fit
        The corrected model.
    log : int
        The log, from 0, of parameters that differ between logs, such as when a fault set in.

    Raises
    ------
    ClieError
        If a cause and its effect do not share their parameters.

    """
    hypothesis = model.hypothesis
    return [_setting(member, hypothesis.problem, hypothesis.of_log(log))
            for member in hypothesis.members if not is_number(member.cause)]


def _setting(member: Member, problem: Problem, values: Mapping[str, np.ndarray]) -> Setting:
    cause, effect = member.cause, LIBRARY[member.cause.name]
    known = {parameter.name: parameter for parameter in effect.parameters}
    chosen: dict[str, Any] = {number.name: values[f"{member.name}.{number.name}"]
                              for number in cause.numbers if not number.switch}
    if cause.of_effect is not None:
        chosen = cause.of_effect(problem, values)
    chosen |= {p.name: problem.gear_ratio for p in effect.parameters
               if p.of == "robot" and p.name == "gear_ratio"}
    strangers = [name for name in chosen if name not in known]
    if strangers:
        raise ClieError(f"{effect.name} cannot be inserted: the diagnosis describes it by "
                        f"{', '.join(chosen)}, its block by {', '.join(known)}; call the effect "
                        "with values of your own")
    per_joint = any(number.scope != "robot" for number in cause.numbers)
    arguments = {name: value if known[name].per_joint else np.ravel(value)[0]
                 for name, value in {**cause.held, **chosen}.items()}
    return effect(joints=list(member.joints) if per_joint else None, **arguments)
