"""Supply voltage that sags under the current of all joints."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def sagging_torque(u: np.ndarray, sag: PerJoint) -> np.ndarray:
    """Torque under a sagging supply [N m]: ``u max(0, 1 - sag sum_j |u_j|)``."""
    drawn = np.sum(np.abs(u), axis=-1, keepdims=True)
    return u * np.maximum(0.0, 1.0 - sag * drawn)


SUPPLY_SAG = Effect(
    name="supply_sag", family="drive", port="drive",
    build=Static(sagging_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("sag", "1/(N m)", 0.0, 1e3, 0.02, 0.0,
                  "relative loss of voltage per torque of all joints", per_joint=False),
    ),
    equation="u_motor_k = u_k max(0, 1 - sag sum_j |u_j|)",
    reference="M. Duclusaud, G. Passault, V. Padois, O. Ly, Extended Friction Models for the "
              "Physics Simulation of Servo Actuators, 2024 (supply resistance of the test bench)",
    signature="All joints weaken together when the total torque is high.",
    confused_with={
        "actuator_saturation": "move one joint at a time: sag needs the other joints",
        "motor_heating": "repeat at once: sag has no memory",
        "torque_gain_error": "ladder of amplitudes: sag grows with the torque",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Battery with internal resistance"},
    wrong="Torque stands for current, also while braking, and the bus capacitor is left out.",
    symmetry="odd", per_joint=False, curve=("u", 10.0),
)
