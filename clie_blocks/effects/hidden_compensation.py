"""Compensation of weight and friction that the drive adds by itself."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def compensated_torque(q: np.ndarray, dq: np.ndarray, u: np.ndarray, weight: PerJoint,
                       friction: PerJoint, width: PerJoint) -> np.ndarray:
    """Torque with compensation [N m]: ``u + weight cos q + friction tanh(dq / width)``."""
    return u + weight * np.cos(q) + friction * np.tanh(dq / width)


HIDDEN_COMPENSATION = Effect(
    name="hidden_compensation", family="controller", port="controller",
    build=Static(compensated_torque, inputs=("q", "dq", "u"), outputs=("u",)),
    parameters=(
        Parameter("weight", "N m", -1e3, 1e3, 0.5, 0.0, "compensated weight at q = 0"),
        Parameter("friction", "N m", 0.0, 1e3, 0.05, 0.0, "compensated friction"),
        Parameter("width", "rad/s", 1e-6, 10.0, 0.02, None, "speed over which it changes sign"),
    ),
    equation="u = law + weight cos q + friction tanh(dq / width)",
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, section 8.5.1",
    signature="Gravity or friction seems missing; over-compensated friction makes a limit cycle.",
    confused_with={
        "gravity": "read the command: compensation is in u, gravity in the motion only",
        "coulomb": "read the command: negative friction can only come from the law",
        "hidden_integral": "load step: an integral needs time to answer",
        "offset": "hold at several poses over more than 1 rad",
    },
    simulators={
        "mujoco": "body gravcomp, joint actuatorgravcomp",
        "isaac": "disable_gravity of the links",
        "gazebo": "none",
        "simscape": "none",
    },
    wrong="Each joint compensates for its own angle alone; arms do it with all of them.",
    symmetry="none", stiff=True, curve=("q", 3.2),
)
