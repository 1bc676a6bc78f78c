"""Cogging torque of a motor."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def cogging_torque(q: np.ndarray, sine: PerJoint, cosine: PerJoint,
                   order: PerJoint) -> np.ndarray:
    """Cogging torque ``sine sin(order q) + cosine cos(order q)`` [N m]: no loss over a period."""
    return sine * np.sin(order * q) + cosine * np.cos(order * q)


TORQUE_RIPPLE = Effect(
    name="torque_ripple", family="drive", port="load",
    build=Static(cogging_torque, inputs=("q",)),
    parameters=(
        Parameter("sine", "N m", -100.0, 100.0, 0.1, 0.0, "amplitude of the sine"),
        Parameter("cosine", "N m", -100.0, 100.0, 0.0, 0.0, "amplitude of the cosine"),
        Parameter("order", "1", 0.1, 1e5, 50.0, None,
                  "periods per turn of the joint: slots of the motor times gear ratio"),
    ),
    equation="tau = sine sin(order q) + cosine cos(order q)",
    reference="J. R. Hendershot, T. J. E. Miller, Design of Brushless Permanent-Magnet Machines, "
              "chapter on cogging torque",
    signature="A wave over position, alike in both directions; its line in the spectrum moves "
              "with the speed, its amplitude in torque does not.",
    confused_with={
        "kinematic_error": "speed ladder: constant amplitude in torque against one in position",
        "commutation_ripple": "vary the load: cogging does not grow with the torque",
        "gear_mesh_ripple": "vary the load: cogging does not grow with the torque",
        "position_dependent_friction": "same path both ways: friction changes sign",
        "periodic_disturbance": "stand still: cogging needs motion",
        "encoder_eccentricity": "speed ladder: constant amplitude in torque against one in "
                                "position",
    },
    simulators={
        "mujoco": "actuator dcmotor cogging (amplitude, periods, phase)",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "BLDC or PMSM, cogging torque by table",
    },
    wrong="One harmonic; real cogging has several.",
    passive=True, symmetry="none", curve=("q", 0.5),
)
