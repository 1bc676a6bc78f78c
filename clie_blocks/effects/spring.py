"""Springs at the joint: cables and hoses."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def spring_torque(q: np.ndarray, stiffness: PerJoint, rest: PerJoint,
                  hardening: PerJoint) -> np.ndarray:
    """Spring torque ``stiffness x (1 + hardening x^2)``, ``x = q - rest`` [N m]."""
    stretch = q - rest
    return stiffness * stretch * (1.0 + hardening * stretch * stretch)


SPRING = Effect(
    name="spring", family="load", port="load",
    build=Static(spring_torque, inputs=("q",)),
    parameters=(
        Parameter("stiffness", "N m/rad", -1e4, 1e4, 0.2, 0.0,
                  "stiffness at the rest angle; negative beyond the dead centre of a spring"),
        Parameter("rest", "rad", -10.0, 10.0, 0.0, None, "angle without torque"),
        Parameter("hardening", "1/rad^2", 0.0, 10.0, 0.3, None, "growth of the stiffness"),
    ),
    equation="tau = stiffness (q - rest) (1 + hardening (q - rest)^2)",
    reference="T. Brogardh, Robot control overview: an industrial perspective, Modeling, "
              "Identification and Control 30(3), 2009 (dress packs)",
    signature="A torque that pulls to one pose; smaller error at higher Kp, equal both ways.",
    confused_with={
        "gravity": "sweep the full range: a straight line against a cosine",
        "counterbalance": "sweep the full range: a counterbalance follows a sine",
        "gain_error": "change the set-point: a spring pulls to its own pose",
        "encoder_offset": "compare poses with an external measurement",
    },
    simulators={
        "mujoco": "joint stiffness and springref",
        "isaac": "drive stiffness with a target",
        "gazebo": "<spring_stiffness>, <spring_reference>",
        "simscape": "Rotational Spring",
    },
    wrong="Cables also rub and have hysteresis; their torque depends on all joints they pass.",
    passive=True, symmetry="odd", side="link", curve=("q", 2.0),
)
