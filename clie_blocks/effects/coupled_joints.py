"""Joint that moves along with the one before, as wrists and differentials do."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def dragged_motion(q: np.ndarray, dq: np.ndarray,
                   ratio: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the links: joint k moves by ratio_k of joint k - 1 as well."""
    return q + ratio * _joint_before(q), dq + ratio * _joint_before(dq)


def _joint_before(signal: np.ndarray) -> np.ndarray:
    return np.concatenate((0.0 * signal[..., :1], signal[..., :-1]), axis=-1)


COUPLED_JOINTS = Effect(
    name="coupled_joints", family="transmission", port="transmission",
    build=Static(dragged_motion, inputs=("q", "dq"), outputs=("q", "dq")),
    parameters=(
        Parameter("ratio", "1", -10.0, 10.0, 0.05, 0.0,
                  "travel of the joint per travel of the joint before; none for the first"),
    ),
    equation="q_link_k = q_k + ratio_k q_(k-1)",
    reference="A. Janot, P.-O. Vandanjon, M. Gautier, IEEE Trans. Control Systems Technology "
              "22(1), 2014 (wrist of the TX40)",
    signature="A joint at rest moves when its neighbour does, also slowly.",
    confused_with={
        "coupling": "quasi-static moves, one joint at a time: inertia does not couple then",
        "gravity": "quasi-static moves of the joint before, in a horizontal plane",
        "ratio_error": "move the joint alone: coupling is gone",
    },
    simulators={
        "mujoco": "equality joint, or fixed tendon",
        "isaac": "mimic joint",
        "gazebo": "<mimic>",
        "simscape": "Differential, or Gear Constraint",
    },
    wrong="The joint before does not feel the torque that it passes on; friction of the coupling "
          "is left out.",
    symmetry="odd", per_joint=False,
)
