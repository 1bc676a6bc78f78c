"""A base that does not stand level, seen by a model that knows the arm's weight."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.chain import GEAR_RATIO, absolute, onto_joints
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def base_tilt_torque(q: np.ndarray, tilt: PerJoint, weight: PerJoint,
                     gear_ratio: PerJoint = 1.0) -> np.ndarray:
    """Gravity torque of a tilted arm, less that of the level arm [N m]."""
    angle = absolute(q)
    return onto_joints(weight * (np.cos(angle + tilt) - np.cos(angle))) / gear_ratio


BASE_TILT = Effect(
    name="base_tilt", family="load", port="load",
    build=Static(base_tilt_torque, inputs=("q",)),
    parameters=(
        Parameter("tilt", "rad", -0.6, 0.6, 0.03, 0.0,
                  "rotation of the base about the joint axes", per_joint=False),
        Parameter("weight", "N m", -1e3, 1e3, 0.5, None,
                  "moment m c g of the link, and of all it carries at its end"),
        GEAR_RATIO,
    ),
    equation="tau_k = 1/r_k sum over j >= k of weight_j (cos(q_0 + ... + q_j + tilt) - "
             "cos(q_0 + ... + q_j))",
    reference="M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, "
              "chapter 7, with gravity turned",
    signature="An error like gravity, a quarter turn ahead, on all joints with one angle.",
    confused_with={
        "gravity": "poses over half a turn: the tilt's cosine is shifted by a quarter turn",
        "encoder_offset": "level the base: an offset of the first joint looks the same",
        "payload": "fast motion: a payload adds inertia",
    },
    simulators={
        "mujoco": "option gravity, turned",
        "isaac": "gravity direction",
        "gazebo": "<pose> of the model",
        "simscape": "Mechanism Configuration, gravity vector",
    },
    wrong="Tilt in the plane of the arm only. With the first joint's encoder offset it forms an "
          "exact pair.",
    passive=True, symmetry="none", per_joint=False, side="link", curve=("q", 3.2),
)
