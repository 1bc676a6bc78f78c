"""Torque or current sensor of the recorder with a wrong gain and a bias."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def misread_torque(u: np.ndarray, error: PerJoint, bias: PerJoint) -> np.ndarray:
    """Torque as logged [N m]: ``(1 + error) u + bias``."""
    return (1.0 + error) * u + bias


SENSOR_GAIN = Effect(
    name="sensor_gain", family="sensor", port="log",
    build=Static(misread_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("error", "1", -1.0, 10.0, 0.05, 0.0, "relative error of the gain"),
        Parameter("bias", "N m", -1e3, 1e3, 0.0, 0.0, "reading at zero torque"),
    ),
    equation="u_log = (1 + error) u + bias",
    reference="J. Swevers, W. Verdonck, J. De Schutter, IEEE Control Systems Magazine 27(5), 2007",
    signature="The loop behaves as ever; the log's torque is scaled or shifted against the "
              "motion.",
    confused_with={
        "torque_gain_error": "an independent torque sensor; the log alone cannot tell",
        "offset": "switch the drive off: a bias of the reading stays",
        "asymmetric_coulomb": "switch the drive off: a bias of the reading stays",
        "gain_error": "vary Kp: the loop's stiffness follows the true gains",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Gain and Bias behind the torque sensor"},
    wrong="Constant and without lag.",
    symmetry="odd", curve=("u", 5.0),
)
