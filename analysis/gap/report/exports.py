"""The causes of the corrected model for others: names in simulators, effects for a diagram."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    from clie_blocks.effects.effect import Setting

SIMULATORS = ("mujoco", "gazebo", "isaac")


def simulator_names(effect: str) -> tuple[str, ...]:
    """Name and parameter of an effect in MuJoCo, URDF or Gazebo, and Isaac; ``none`` without."""
    return tuple(LIBRARY[effect].simulators.get(name, "none") for name in SIMULATORS)


def settings(model: Fit) -> list[Setting]:
    """Return the causes of a fitted model as effects of the catalogue, for `with_effects`.

    Numbers of the robot file that are off are no effects: they belong into the plant.

    Raises
    ------
    ClieError
        If a cause and its effect do not share their parameters, or one differs between logs.

    """
    return [_setting(member, model.hypothesis.values) for member in model.hypothesis.members
            if not is_number(member.cause)]


def _setting(member: Member, values: Mapping[str, np.ndarray]) -> Setting:
    effect = LIBRARY[member.cause.name]
    numbers = [number for number in member.cause.numbers if not number.switch]
    known = {parameter.name: parameter for parameter in effect.parameters}
    strangers = [number.name for number in numbers if number.name not in known]
    if strangers:
        raise ClieError(f"{effect.name} cannot be inserted: the diagnosis describes it by "
                        f"{', '.join(number.name for number in numbers)}, its block by "
                        f"{', '.join(known)}; call the effect with values of your own")
    by_log = [number.name for number in numbers if number.scope == "log"]
    if by_log:
        raise ClieError(f"{effect.name} cannot be inserted: {' and '.join(by_log)} differs "
                        "between the logs; call the effect with the value of one log")
    chosen = {number.name: values[f"{member.name}.{number.name}"] for number in numbers}
    per_joint = any(number.scope == "joint" for number in numbers)
    arguments: dict[str, Any] = {name: value if known[name].per_joint else value.flat[0]
                                 for name, value in chosen.items()}
    return effect(joints=list(member.joints) if per_joint else None, **arguments)
