"""Gear losses that differ between driving and being driven."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def directional_loss_limits(dq: np.ndarray, u: np.ndarray, driving: PerJoint,
                            backdriving: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Largest loss torque [N m]: `driving` of |u| while the motor drives, else `backdriving`."""
    with_u, against_u = driving * np.abs(u), backdriving * np.abs(u)
    return np.where(u > 0, with_u, against_u), np.where(u < 0, with_u, against_u)


DIRECTIONAL_EFFICIENCY = Effect(
    name="directional_efficiency", family="friction", port="load",
    build=dry_friction(directional_loss_limits, inputs=("dq", "u")),
    parameters=(
        Parameter("driving", "1", 0.0, 0.9, 0.1, 0.0, "loss of torque while the motor drives"),
        Parameter("backdriving", "1", 0.0, 0.9, 0.2, 0.0, "loss while the load drives"),
        WIDTH,
    ),
    equation="tau = (driving if u dq > 0 else backdriving) |u| tanh(dq / width)",
    reference="C. Pelchen, C. Schweiger, M. Otter, Modeling and Simulating the Efficiency of "
              "Gearboxes and of Planetary Gearboxes, Modelica Conference 2002",
    signature="Friction larger in one direction of the power flow: lifting against lowering.",
    confused_with={
        "load_dependent_friction": "lift and lower at equal speed and load",
        "gravity": "two payloads: the loss is a share of the torque, in both directions",
        "torque_gain_error": "lower a load: a gain error helps as much as it hinders",
        "asymmetric_coulomb": "turn the load around: efficiency follows the power, not the sign",
    },
    simulators={
        "mujoco": "none",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Simple Gear, constant efficiency",
    },
    wrong="Efficiency is constant; real gears lose relatively more at small torque. " + CREEP,
    passive=True, symmetry="odd", stiff=True, curve=("dq", 0.01),
)
