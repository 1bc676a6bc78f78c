"""Weight of the links of a planar arm."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.chain import GEAR_RATIO, absolute, onto_joints
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def gravity_torque(q: np.ndarray, weight: PerJoint, gear_ratio: PerJoint = 1.0) -> np.ndarray:
    """Gravity torque of joint k [N m]: sum_(j >= k) weight_j cos(q_0 + ... + q_j) / r_k, (1)."""
    return onto_joints(weight * np.cos(absolute(q))) / gear_ratio


GRAVITY = Effect(
    name="gravity", family="load", port="load",
    build=Static(gravity_torque, inputs=("q",)),
    parameters=(
        Parameter("weight", "N m", -1e3, 1e3, 0.05, 0.0,
                  "moment m c g of the link, and of all it carries at its end"),
        GEAR_RATIO,
    ),
    equation="tau_k = 1/r_k sum over j >= k of weight_j cos(q_0 + ... + q_j)",
    reference="paper, eqs. (1)-(7); M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling "
              "and Control, chapter 7",
    signature="A torque that depends on the pose alone, equal in both directions of motion; at "
              "one pose only a constant offset.",
    confused_with={
        "payload": "fast motion: a payload adds inertia as well",
        "offset": "hold at several poses over more than 1 rad",
        "spring": "sweep the full range: a cosine against a straight line",
        "encoder_offset": "compare poses with an external measurement",
        "step_fault": "return to the first pose: gravity comes back to its first value",
    },
    simulators={
        "mujoco": "option gravity with body mass and ipos; joint gravcomp takes it away",
        "isaac": "gravity with link mass and centre of mass",
        "gazebo": "<gravity> with <inertial>",
        "simscape": "Mechanism Configuration, gravity",
    },
    wrong="All links move in one vertical plane; the links' inertia belongs to the plant.",
    passive=True, symmetry="even", per_joint=False, side="link", curve=("q", 3.2),
)
