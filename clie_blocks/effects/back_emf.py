"""Back-EMF of a motor driven by voltage instead of current."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def voltage_driven_torque(u: np.ndarray, dq: np.ndarray, damping: PerJoint) -> np.ndarray:
    """Torque of a motor behind a voltage drive [N m]: ``u - damping dq``."""
    return u - damping * dq


BACK_EMF = Effect(
    name="back_emf", family="drive", port="drive",
    build=Static(voltage_driven_torque, inputs=("u", "dq"), outputs=("u",)),
    parameters=(
        Parameter("damping", "N m s/rad", 0.0, 1e3, 0.2, 0.0,
                  "kt^2/R of the winding, reflected to the joint's torque and speed"),
    ),
    equation="u_motor = u - damping dq, damping = kt^2/R",
    reference="M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, section 6.2",
    signature="More viscous damping, while the drive is powered.",
    confused_with={
        "viscous": "let the joint swing with the drive off: back-EMF is gone",
        "torque_gain_error": "constant speeds: a gain error needs torque",
        "gain_error": "vary Kd by a known step and compare",
        "torque_speed_limit": "small torques at high speed: back-EMF acts there too",
    },
    simulators={
        "mujoco": "actuator dcmotor motorconst, resistance; or velocity gain in biasprm",
        "isaac": "damping of the drive",
        "gazebo": "<dynamics><damping>",
        "simscape": "DC Motor, back-EMF constant",
    },
    wrong="No inductance, and a short circuit that follows from an open bridge is not modelled.",
    symmetry="odd", curve=("dq", 5.0),
)
