"""Joint with an elastic gear: motor and link swing against each other."""

import numpy as np

from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.two_bodies import MOTOR, TwoBodies
from clie_blocks.labels import PerJoint


def elastic_torque(twist: np.ndarray, twist_rate: np.ndarray, compliance: PerJoint,
                   damping: PerJoint) -> np.ndarray:
    """Torque of a linear spring and damper [N m]: ``twist / compliance + damping twist_rate``."""
    return twist / np.where(compliance > 0, compliance, 1.0) + damping * twist_rate


def is_elastic(compliance: np.ndarray) -> np.ndarray:
    """Joints that give way."""
    return compliance > 0


DAMPING = Parameter("damping", "N m s/rad", 0.0, 1e4, 2.0, None, "damping of the gear's twist")

JOINT_ELASTICITY = Effect(
    name="joint_elasticity", family="transmission", port="transmission",
    build=TwoBodies(elastic_torque, is_elastic),
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.0, 10.0, 2e-4, 0.0,
                  "twist per torque of the motor: gear ratio over the joint's stiffness"),
        DAMPING, *MOTOR,
    ),
    equation="torque = twist / compliance + damping twist', twist = q_motor - q",
    reference="M. W. Spong, ASME J. Dynamic Systems, Measurement and Control 109(4), 1987",
    signature="Antiresonance at sqrt(stiffness/link inertia) and a resonance above it; ringing "
              "after stops; a twist in proportion to the load.",
    confused_with={
        "stiffening_elasticity": "sweeps at several static loads: a linear spring keeps its peak",
        "backlash": "amplitude ladder: backlash is loose for small torques, a spring is not",
        "time_delay": "excite past the resonance: a delay has no peak",
        "actuator_lag": "excite past the resonance: a lag has no peak",
        "torsional_hysteresis": "slow torque loop with a link encoder: a spring has no width",
        "presliding": "encoder on motor and link: friction does not twist the gear",
    },
    simulators={
        "mujoco": "extra body and hinge with stiffness, damping; armature on the motor",
        "isaac": "extra joint with a drive",
        "gazebo": "extra link and joint with <spring_stiffness>",
        "simscape": "Rotational Spring, Rotational Damper between two inertias",
    },
    wrong="One linear spring per joint; the rotor's gyroscopic effects are left out.",
    passive=True, symmetry="odd", stiff=True, curve=("twist", 2e-3),
)
