"""Torque per command is not what the datasheet says."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def scaled_torque(u: np.ndarray, error: PerJoint) -> np.ndarray:
    """Torque ``(1 + error) u`` [N m]."""
    return (1.0 + error) * u


TORQUE_GAIN_ERROR = Effect(
    name="torque_gain_error", family="drive", port="drive",
    build=Static(scaled_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("error", "1", -1.0, 10.0, 0.1, 0.0, "relative error of the torque constant"),
    ),
    equation="u_motor = (1 + error) u",
    reference="J. Swevers, W. Verdonck, J. De Schutter, IEEE Control Systems Magazine 27(5), 2007",
    signature="Inertia, friction and gravity all seem scaled alike.",
    confused_with={
        "torque_gain": "the same model, counted as a parameter",
        "inertia": "hold a known mass: a gain error shows at rest",
        "gain_error": "compare the command with the control law: gains change the command",
        "sensor_gain": "an independent torque sensor; the log alone cannot tell",
        "motor_heating": "repeat the first run at the end: heat fades, a gain error stays",
    },
    simulators={
        "mujoco": "actuator gear or gainprm",
        "isaac": "scale of the effort",
        "gazebo": "none",
        "simscape": "DC Motor, torque constant",
    },
    wrong="Constant; saturation of the iron lowers the gain at large torque.",
    symmetry="odd", curve=("u", 5.0),
)
