"""Gains of the controller that are not those stated, up to degrees for radians."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def misjudged_errors(q_d: np.ndarray, q: np.ndarray, dq: np.ndarray, kp_error: PerJoint,
                     kd_error: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Set-point and velocity that scale Kp by 1 + kp_error and Kd by 1 + kd_error."""
    return q_d + kp_error * (q_d - q), (1.0 + kd_error) * dq


GAIN_ERROR = Effect(
    name="gain_error", family="controller", port="controller",
    build=Static(misjudged_errors, inputs=("q_d", "q", "dq"), outputs=("q_d", "dq")),
    parameters=(
        Parameter("kp_error", "1", -1.0, 100.0, 0.1, 0.0,
                  "relative error of Kp; 56.3 for a gain per degree taken as per radian"),
        Parameter("kd_error", "1", -1.0, 100.0, 0.1, 0.0, "relative error of Kd"),
    ),
    equation="u = (1 + kp_error) Kp (q_d - q) - (1 + kd_error) Kd dq + pe",
    reference="NVIDIA Isaac Sim, joint drives: stiffness and damping of USD are per degree",
    signature="Wrong stiffness at rest and wrong bandwidth; the stated law does not reproduce "
              "the logged u.",
    confused_with={
        "torque_gain_error": "compare the command with the control law: gains change the command",
        "inertia": "a known static load: it moves by torque/Kp",
        "viscous": "replay the law on the log: Kd shows in the command",
        "back_emf": "replay the law on the log: Kd shows in the command",
        "velocity_filter_mismatch": "excite below and above the corner: a gain is off at both",
    },
    simulators={
        "mujoco": "actuator kp, kv",
        "isaac": "stiffness, damping (per degree in USD)",
        "gazebo": "gains of the joint position controller",
        "simscape": "PID Controller",
    },
    wrong="Made for laws that act on q_d - q and on dq, as (11) does.",
    symmetry="odd", curve=("q_d", 1.0),
)
