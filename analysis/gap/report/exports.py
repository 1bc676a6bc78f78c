"""The causes of the corrected model for others: names in simulators, effects for a diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.causes.cause import EffectValues
from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.controller.named import NamedJoint
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.library import TERM, effect_of
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    from clie_blocks.effects.effect import Effect, Setting

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
        If no effect of the catalogue is the same as a cause.

    """
    hypothesis = model.hypothesis
    return [setting for member in hypothesis.members if not is_number(member.cause)
            for setting in member_settings(member, hypothesis.problem, hypothesis.of_log(log))]


def member_settings(member: Member, problem: Problem, values: Mapping[str, np.ndarray],
                    ) -> list[Setting]:
    """Return one cause of a fitted model as effects of the catalogue, as `settings` does."""
    cause = member.cause
    by_name: EffectValues = {cause.name: {
        number.name: values[f"{member.name}.{number.name}"] for number in cause.numbers
        if not number.switch}}
    if cause.of_effect is not None:
        by_name = cause.of_effect(problem, values)
    if not by_name:
        numbers = ", ".join(number.name for number in cause.numbers)
        known = ", ".join(p.name for p in LIBRARY[cause.name].parameters)
        raise ClieError(
            f"{cause.name} cannot be inserted: the diagnosis describes it by {numbers}, its block "
            f"by {known}, which is not the same here; call the effect with values of your own")
    per_joint = any(number.scope != "robot" for number in cause.numbers)
    joints = list(member.joints) if per_joint else None
    return [_setting(effect_of(name), {**cause.held, **chosen}, joints, problem,
                     member.name if name == TERM else None)
            for name, chosen in by_name.items()]


def _setting(effect: Effect, chosen: Mapping[str, np.ndarray | float], joints: list[int] | None,
             problem: Problem, block: str | None = None) -> Setting:
    """An effect with some parameters at some joints, and the gear ratios that it reads."""
    known = {parameter.name: parameter for parameter in effect.parameters}
    of_robot = {p.name: problem.gear_ratio for p in effect.parameters
                if p.of == "robot" and p.name == "gear_ratio"}
    arguments = {name: value if known[name].per_joint else np.ravel(value)[0]
                 for name, value in {**of_robot, **chosen}.items()}
    return effect(joints=joints, name=block, **arguments)


def law_settings(named: Sequence[NamedJoint], n: int) -> list[Setting]:
    """Return the effects that the commands of some joints show, for the law or the recorder.

    Parameters
    ----------
    named : list of NamedJoint
        Joints with what explains their commands best.
    n : int
        Joints of the robot.

    """
    values: dict[str, dict[str, np.ndarray]] = {}
    joints: dict[str, list[int]] = {}
    for one in named:
        found = one.found[0]
        joints.setdefault(found.name, []).append(one.joint)
        for name, value in {**found.candidate.held, **found.values}.items():
            parameter = found.candidate.parameter(name)
            values.setdefault(found.name, {}).setdefault(
                name, np.full(n, parameter.default))[one.joint] = value
    return [LIBRARY[name](joints=joints[name], name=None, **chosen)
            for name, chosen in values.items()]
