"""Rubber stops at the ends of a joint's range."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def soft_stop_torque(q: np.ndarray, dq: np.ndarray, stiffness: PerJoint, lower: PerJoint,
                     upper: PerJoint, damping: PerJoint) -> np.ndarray:
    """Torque of a stop [N m]: pushes back, more while it is compressed, and never pulls."""
    beyond, below = np.maximum(q - upper, 0.0), np.minimum(q - lower, 0.0)
    return stiffness * (beyond * np.maximum(1.0 + damping * dq, 0.0)
                        + below * np.maximum(1.0 - damping * dq, 0.0))


SOFT_STOP = Effect(
    name="soft_stop", family="load", port="load",
    build=Static(soft_stop_torque, inputs=("q", "dq")),
    parameters=(
        Parameter("stiffness", "N m/rad", 0.0, 1e5, 20.0, 0.0, "stiffness of the stop"),
        Parameter("lower", "rad", -10.0, 10.0, -1.0, None, "angle of the lower stop"),
        Parameter("upper", "rad", -10.0, 10.0, 1.0, None, "angle of the upper stop"),
        Parameter("damping", "s/rad", 0.0, 10.0, 0.5, None,
                  "loss; an impact at speed v gives back about 1 - 2/3 damping v of it"),
    ),
    equation="tau = stiffness max(q - upper, 0) max(1 + damping dq, 0), and alike below",
    reference="K. H. Hunt, F. R. E. Crossley, Coefficient of Restitution Interpreted as Damping "
              "in Vibroimpact, J. Appl. Mech. 42(2), 1975",
    signature="Nothing in the middle, a steep torque near the ends of the range.",
    confused_with={
        "actuator_saturation": "map the error over position: a stop stays at its angle",
        "spring": "small motion in the middle of the range: a stop is absent",
        "step_fault": "return to the middle: a stop lets go",
    },
    simulators={
        "mujoco": "joint range with solreflimit, solimplimit",
        "isaac": "joint limits with stiffness and damping",
        "gazebo": "<limit><stiffness>, <dissipation>",
        "simscape": "Rotational Hard Stop",
    },
    wrong="Linear rubber; real stops harden, and hard ones ring in milliseconds.",
    passive=True, symmetry="odd", stiff=True, side="link", curve=("q", 1.5),
)
