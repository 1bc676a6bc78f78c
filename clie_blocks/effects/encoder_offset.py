"""Zero of an encoder that is off."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def shifted_position(q: np.ndarray, offset: PerJoint) -> np.ndarray:
    """Position as measured [rad]: ``q + offset``."""
    return q + offset


ENCODER_OFFSET = Effect(
    name="encoder_offset", family="sensor", port="sensor",
    build=Static(shifted_position, inputs=("q",), outputs=("q",)),
    parameters=(
        Parameter("offset", "rad", -7.0, 7.0, 0.02, 0.0, "measured minus true angle"),
    ),
    equation="q_measured = q + offset",
    reference="Z. Roth, B. Mooring, B. Ravani, IEEE J. Robotics and Automation 3(5), 1987",
    signature="All poses shifted alike; invisible for a joint without weight or limits, seen as "
              "a shifted cosine with weight.",
    confused_with={
        "gravity": "compare poses with an external measurement",
        "base_tilt": "turn a vertical joint: tilt acts there, an offset does not",
        "ratio_error": "two poses far apart with an external measurement",
        "offset": "vary Kp: a torque moves the joint by torque/Kp",
    },
    simulators={
        "mujoco": "joint ref",
        "isaac": "offset of the observed joint position",
        "gazebo": "none",
        "simscape": "Bias behind the motion sensor",
    },
    wrong="Starts with the joint at q = 0 measured as the offset, so the loop moves at once.",
    symmetry="none", curve=("q", 0.1),
)
