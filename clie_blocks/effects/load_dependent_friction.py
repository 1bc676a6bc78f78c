"""Gear friction that grows with the torque the gear carries."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def load_dependent_limits(dq: np.ndarray, u: np.ndarray, level: PerJoint,
                          share: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Largest friction torque ``level + share |u|`` [N m] of a gear that carries u."""
    limit = level + share * np.abs(u)
    return limit, limit


LOAD_DEPENDENT_FRICTION = Effect(
    name="load_dependent_friction", family="friction", port="load",
    build=dry_friction(load_dependent_limits, inputs=("dq", "u")),
    parameters=(
        Parameter("share", "1", 0.0, 0.9, 0.1, 0.0, "friction over carried torque"),
        Parameter("level", "N m", 0.0, 100.0, 0.0, 0.0, "friction torque without load"),
        WIDTH,
    ),
    equation="tau = (level + share |u|) tanh(dq / width)",
    reference="M. Duclusaud, G. Passault, V. Padois, O. Ly, Extended Friction Models for the "
              "Physics Simulation of Servo Actuators, 2024 (share 0.03 to 0.31)",
    signature="The step at a reversal grows with gravity torque and payload.",
    confused_with={
        "coulomb": "two payloads at two poses and equal speed: the step changes with load",
        "directional_efficiency": "lift and lower at equal speed and load",
        "position_dependent_friction": "same path with another payload",
        "torque_gain_error": "hold at rest: a gain error stays, friction has no direction",
    },
    simulators={
        "mujoco": "none (frictionloss rewritten at every step)",
        "isaac": "none (old PhysX joint friction coefficient)",
        "gazebo": "none",
        "simscape": "Gear with meshing losses",
    },
    wrong="The carried torque is taken as the motor's, which is too high by the rotor's own "
          "acceleration. " + CREEP,
    passive=True, symmetry="odd", stiff=True, curve=("dq", 0.01),
)
