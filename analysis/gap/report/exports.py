"""The corrected model for others: joint side for a simulator, effects for a diagram."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    from clie_blocks.effects.effect import Setting

SIMULATORS = ("mujoco", "gazebo", "isaac")
SHORTEST_STEP = 1e-4  # s: of a MuJoCo model whose history buffer still holds a delay
FROM_CHECK = {"velocity_filter_mismatch", "encoder_quantization"}


def simulator_names(effect: str) -> tuple[str, ...]:
    """Name and parameter of an effect in MuJoCo, URDF or Gazebo, and Isaac; ``none`` without."""
    return tuple(LIBRARY[effect].simulators.get(name, "none") for name in SIMULATORS)


def force_per_command(result: Result) -> np.ndarray:
    """Torque or force per unit of command, shape (n,): 1 where the command is a torque."""
    records = result.problem.records
    gain = records[0].robot.motor.torque_gain if records and records[0].robot else None
    return np.ones(result.problem.n) if gain is None else np.asarray(gain)


def joint_side(result: Result, force: ArrayLike = 1.0) -> list[dict[str, Any]]:
    """Parameters of the corrected model as a simulator of joints takes them, per joint.

    Parameters
    ----------
    result : Result
        The diagnosis.
    force : array_like, shape () or (n,)
        Torque or force per unit of command, see `force_per_command`.

    Returns
    -------
    list of dict
        ``armature`` [kg m^2], ``damping`` [N m s/rad], ``frictionloss`` [N m], ``gear`` [1],
        ``limit`` [N m at the motor] and ``delay`` [s] of each joint; None where it has none.
        Motor-side torques are multiplied by the gear ratio.

    """
    problem, values = result.problem, result.model.hypothesis.values
    ratio = problem.gear_ratio
    force = np.broadcast_to(force, ratio.shape)
    torque = force * ratio  # at the joint, per unit of command
    friction = _first(values, ("coulomb.level", "stribeck.level"))
    gain = values.get("torque_gain_error.error", np.zeros(problem.n))
    limit, delay = values.get("actuator_saturation.limit"), values.get("time_delay.time")
    return [{
        "name": problem.joints[k],
        "armature": torque[k] * values["inertia"][k] - problem.chain.diagonal[k],
        "damping": torque[k] * values["damping"][k],
        "frictionloss": None if friction is None else torque[k] * friction[k],
        "gear": ratio[k] * (1.0 + gain[k]),
        "limit": None if limit is None or limit[k] > 1e6 else force[k] * limit[k],
        "delay": None if delay is None else delay[k],
    } for k in range(problem.n)]


def _first(values: Mapping[str, np.ndarray], keys: Iterable[str]) -> np.ndarray | None:
    return next((values[key] for key in keys if key in values), None)


def corrected_model(result: Result, force: ArrayLike = 1.0) -> str:
    """Joints and motors of the corrected model, as text to paste into a MuJoCo model.

    The inertia of known links is left out of the armature: it comes with their bodies.

    Parameters
    ----------
    result : Result
        The diagnosis.
    force : array_like, shape () or (n,)
        Torque or force per unit of command, see `force_per_command`.

    """
    rows = joint_side(result, force)
    lines = ["<mujoco>", f"  <!-- verdict: {result.verdict} -->",
             "  <!-- copy these attributes to your joints and motors -->", "  <worldbody>"]
    lines += [f"    <joint {_attributes(row, ('name', 'armature', 'damping', 'frictionloss'))}/>"
              for row in rows]
    lines += ["  </worldbody>", "  <actuator>"]
    for row in rows:
        motor = {"joint": row["name"], "gear": row["gear"]}
        if row["limit"] is not None:
            motor["forcerange"] = f"{-row['limit']:.6g} {row['limit']:.6g}"
        if row["delay"]:
            motor |= {"delay": row["delay"], "nsample": math.ceil(row["delay"] / SHORTEST_STEP)}
        lines.append(f"    <motor {_attributes(motor, motor)}/>")
    return "\n".join([*lines, "  </actuator>", *_comments(result), "</mujoco>", ""])


def _attributes(row: Mapping[str, Any], names: Iterable[str]) -> str:
    shown = {name: row[name] for name in names if row[name] is not None}
    return " ".join(f"{name}={quoteattr(value if isinstance(value, str) else f'{value:.6g}')}"
                    for name, value in shown.items())


def _comments(result: Result) -> Iterator[str]:
    """Comments on causes that are no attribute of a joint or a motor."""
    direct = {"coulomb", "stribeck", "torque_gain_error", "actuator_saturation", "time_delay"}
    for member in result.model.hypothesis.members:
        name = member.cause.name
        if name not in direct:
            yield f"  <!-- {name}: {LIBRARY[name].simulators.get('mujoco', 'none')} -->"


def settings(model: Fit) -> list[Setting]:
    """Return the causes of a fitted model as effects of the catalogue, for `with_effects`.

    Raises
    ------
    ClieError
        If a cause and its effect do not share their parameters, or one differs between logs.

    """
    return [_setting(member, model.hypothesis.values) for member in model.hypothesis.members]


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
