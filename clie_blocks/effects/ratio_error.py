"""Gear ratio or belt that is not what the drawing says."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def stretched_motion(q: np.ndarray, dq: np.ndarray,
                     error: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the link [rad, rad/s]: ``(1 + error)`` times the motor's."""
    return (1.0 + error) * q, (1.0 + error) * dq


RATIO_ERROR = Effect(
    name="ratio_error", family="transmission", port="transmission",
    build=Static(stretched_motion, inputs=("q", "dq"), outputs=("q", "dq")),
    parameters=(
        Parameter("error", "1", -0.9, 10.0, 0.01, 0.0, "relative error of travel per motor turn"),
    ),
    equation="q_link = (1 + error) q",
    reference="Z. Roth, B. Mooring, B. Ravani, IEEE J. Robotics and Automation 3(5), 1987",
    signature="An error of position that grows with the travel.",
    confused_with={
        "encoder_offset": "two poses far apart with an external measurement",
        "gain_error": "compare travel with an external measurement",
        "torque_gain_error": "compare travel with an external measurement",
        "kinematic_error": "sweep far: an error of the ratio grows with the travel",
    },
    simulators={
        "mujoco": "actuator gear, tendon coef",
        "isaac": "gearing of the mimic joint",
        "gazebo": "<gearbox_ratio>",
        "simscape": "Gear Box, ratio",
    },
    wrong="The torque is not scaled with it, and a belt's creep under load is left out.",
    symmetry="odd", curve=("q", 1.0),
)
