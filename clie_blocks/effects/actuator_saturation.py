"""Torque limit of motor or drive."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def saturated_torque(u: np.ndarray, limit: PerJoint) -> np.ndarray:
    """Torque that passes the limit [N m]: u clipped to [-limit, limit]."""
    return np.clip(u, -limit, limit)


ACTUATOR_SATURATION = Effect(
    name="actuator_saturation", family="drive", port="drive",
    build=Static(saturated_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("limit", "N m", 0.0, 1e6, 5.0, 1e6,
                  "largest torque of either sign; the upper bound stands for no limit"),
    ),
    equation="u_motor = clip(u, -limit, limit)",
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions, 1968, table B.1",
    signature="Flat tops of the acceleration at large commands only; small motions are untouched.",
    confused_with={
        "torque_speed_limit": "same torque at low speed: a plain limit does not mind the speed",
        "setpoint_slew": "ladder of steps: a slewed set-point never asks for the torque",
        "gain_error": "ladder of amplitudes: gains act on small motions as well",
        "supply_sag": "move one joint at a time: a limit does not mind the other joints",
    },
    simulators={
        "mujoco": "actuator forcerange, or joint actuatorfrcrange",
        "isaac": "maxForce, effort_limit",
        "gazebo": "<limit><effort>",
        "simscape": "Saturation in front of the Torque Source",
    },
    wrong="Real limits soften with heat and speed, and a current controller near its limit is "
          "slower.",
    symmetry="odd", stiff=True, curve=("u", 12.0),
)
