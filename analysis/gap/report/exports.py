"""What was found in the words of a simulator: joint side, with the names that it uses."""

import math
from xml.sax.saxutils import quoteattr

import numpy as np

from clie_blocks.effects import LIBRARY

SIMULATORS = ("mujoco", "gazebo", "isaac")
SHORTEST_STEP = 1e-4  # s: of a MuJoCo model whose history buffer still holds a delay
FROM_CHECK = {"velocity_filter_mismatch", "encoder_quantization"}


def simulator_names(effect):
    """Name and parameter of an effect in MuJoCo, URDF or Gazebo, and Isaac.

    Parameters
    ----------
    effect : str
        Name in the vocabulary.

    Returns
    -------
    tuple of str
        ``none`` where the simulator has nothing for it.

    """
    return tuple(LIBRARY[effect].simulators.get(name, "none") for name in SIMULATORS)


def force_per_command(diagnosis, records):
    """Torque or force per unit of command, shape (n,): 1 where the command is a torque."""
    gain = records[0].robot.motor.torque_gain if records and records[0].robot else None
    return np.ones(diagnosis.problem.n) if gain is None else np.asarray(gain)


def joint_side(diagnosis, force=1.0):
    """Numbers of the corrected model as a simulator of joints wants them, per joint.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.
    force : array_like, shape () or (n,)
        Torque or force per unit of command, see `force_per_command`.

    Returns
    -------
    list of dict
        ``armature`` [kg m^2], ``damping`` [N m s/rad], ``frictionloss`` [N m], ``gear`` [1],
        ``limit`` [N m at the motor] and ``delay`` [s] of each joint; None where it has none.
        Motor-side torques are multiplied by the gear ratio.

    """
    at, problem = diagnosis.model.hypothesis, diagnosis.problem
    ratio, values = problem.gear_ratio, at.values
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


def _first(values, keys):
    return next((values[key] for key in keys if key in values), None)


def corrected_model(diagnosis, force=1.0):
    """Joints and motors of the corrected model, as text to paste into a MuJoCo model.

    The inertia of known links is left out of the armature: it comes with their bodies.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.
    force : array_like, shape () or (n,)
        Torque or force per unit of command, see `force_per_command`.

    """
    rows = joint_side(diagnosis, force)
    lines = ["<mujoco>", f"  <!-- verdict: {diagnosis.verdict} -->",
             "  <!-- attributes to put on your joints and motors -->", "  <worldbody>"]
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
    return "\n".join([*lines, "  </actuator>", *_without_a_name(diagnosis), "</mujoco>", ""])


def _attributes(row, names):
    shown = {name: row[name] for name in names if row[name] is not None}
    return " ".join(f"{name}={quoteattr(value if isinstance(value, str) else f'{value:.6g}')}"
                    for name, value in shown.items())


def _without_a_name(diagnosis):
    """Comments on causes that are no attribute of a joint or a motor."""
    direct = {"coulomb", "stribeck", "torque_gain_error", "actuator_saturation", "time_delay"}
    for member in diagnosis.model.hypothesis.members:
        name = member.cause.name
        if name not in direct:
            yield f"  <!-- {name}: {LIBRARY[name].simulators.get('mujoco', 'none')} -->"
