"""Friction that grows faster than the speed: churning grease and windage."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def quadratic_drag_torque(dq: np.ndarray, drag: PerJoint, cubic: PerJoint = 0.0) -> np.ndarray:
    """Drag torque ``drag dq |dq| + cubic dq^3`` [N m]: odd in dq."""
    return drag * dq * np.abs(dq) + cubic * dq * dq * dq


QUADRATIC_DRAG = Effect(
    name="quadratic_drag", family="friction", port="load",
    build=Static(quadratic_drag_torque, inputs=("dq",)),
    parameters=(
        Parameter("drag", "N m s^2/rad^2", 0.0, 100.0, 0.01, 0.0, "coefficient of dq |dq|"),
        Parameter("cubic", "N m s^3/rad^3", 0.0, 100.0, 0.0, 0.0, "coefficient of dq^3"),
    ),
    equation="tau = drag dq |dq| + cubic dq^3",
    reference="H. Olsson et al., Friction Models and Friction Compensation, European J. Control "
              "4(3), 1998",
    signature="Friction that curves upward at high speed; invisible when slow.",
    confused_with={
        "viscous": "speed ladder over a factor of four: only drag is curved",
        "fluid_drag": "move the joints before it: fluid drag feels their rotation too",
        "torque_speed_limit": "same speed at low torque: a limit needs both",
        "back_emf": "switch the drive off: back-EMF goes, drag stays",
    },
    simulators={
        "mujoco": "joint damping with polynomial coefficients",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Rotational Damper, nonlinear",
    },
    wrong="Grease thins with shear, so that measured curves often flatten (exponent below 1); "
          "this one only steepens.",
    passive=True, symmetry="odd", curve=("dq", 3.0),
)
