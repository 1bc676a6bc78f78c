"""Play between motor and link."""

import numpy as np

from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.two_bodies import MOTOR, TwoBodies
from clie_blocks.labels import PerJoint


def contact_torque(twist: np.ndarray, twist_rate: np.ndarray, half_gap: PerJoint,
                   stiffness: PerJoint, damping: PerJoint) -> np.ndarray:
    """Torque of the tooth in contact [N m]; none within the gap.

    ``stiffness depth + damping twist_rate`` while the flanks touch, never pulling: it is cut at
    zero.  At the touch it jumps by what the damper gives, as in an inelastic impact.
    """
    depth = twist - np.clip(twist, -half_gap, half_gap)
    pressed = stiffness * depth + np.where(depth == 0.0, 0.0, damping * twist_rate)
    return np.where(twist > 0.0, np.maximum(pressed, 0.0), np.minimum(pressed, 0.0))


def has_gap(half_gap: np.ndarray) -> np.ndarray:
    """Joints with backlash."""
    return half_gap > 0


BACKLASH = Effect(
    name="backlash", family="transmission", port="transmission",
    build=TwoBodies(contact_torque, has_gap),
    parameters=(
        Parameter("half_gap", "rad", 0.0, 0.5, 1e-3, 0.0, "half of the gap, at the joint"),
        Parameter("stiffness", "N m/rad", 1e-3, 1e7, 5e3, None,
                  "in contact: the joint's stiffness over the gear ratio"),
        Parameter("damping", "N m s/rad", 0.0, 1e5, 10.0, None, "damping in contact"),
        *MOTOR,
    ),
    equation="torque = max(stiffness depth + damping twist', 0) where depth > 0, and alike on the "
             "other flank, depth = twist - clip(twist, -half_gap, half_gap)",
    reference="M. Nordin, P.-O. Gutman, Automatica 38(10), 2002; Modelica Standard Library, "
              "ElastoBacklash (contact that never pulls)",
    signature="Lost motion at each reversal of the torque, impacts, a limit cycle of the width of "
              "the gap.",
    confused_with={
        "coulomb": "vary Kp: level/Kp scales, a gap does not",
        "presliding": "amplitude ladder: a dead band against a soft spring",
        "dead_zone": "vary Kp: width/Kp scales, a gap does not",
        "joint_elasticity": "preload with gravity: a gap closes, a spring stays",
        "encoder_quantization": "histogram of q; a gap has no steps",
        "torsional_hysteresis": "amplitude ladder: the loop of hysteresis has no flat part",
        "stiffening_elasticity": "small torques: a soft gear still carries, a gap does not",
    },
    simulators={
        "mujoco": "extra hinge with range = -half_gap half_gap",
        "isaac": "extra joint with limits",
        "gazebo": "extra joint with <limit>",
        "simscape": "Rotational Hard Stop between two inertias",
    },
    wrong="One contact law for both flanks, no oil film; the half gap zero is a rigid joint, not "
          "a stiff one.",
    passive=True, symmetry="odd", stiff=True, curve=("twist", 3e-3),
)
