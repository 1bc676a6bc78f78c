"""Torque ripple of commutation and current sensing."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def rippled_torque(u: np.ndarray, q: np.ndarray, level: PerJoint, depth: PerJoint, order: PerJoint,
                   phase: PerJoint) -> np.ndarray:
    """Torque with ripple [N m]: ``u + (level + depth u) sin(order q + phase)``."""
    return u + (level + depth * u) * np.sin(order * q + phase)


COMMUTATION_RIPPLE = Effect(
    name="commutation_ripple", family="drive", port="drive",
    build=Static(rippled_torque, inputs=("u", "q"), outputs=("u",)),
    parameters=(
        Parameter("depth", "1", 0.0, 1.0, 0.05, 0.0,
                  "part that grows with the torque: unequal gains of the current sensors"),
        Parameter("level", "N m", 0.0, 100.0, 0.02, 0.0,
                  "part that does not: offsets of the current sensors"),
        Parameter("order", "1", 0.1, 1e5, 100.0, None,
                  "periods per turn of the joint: pole pairs times gear ratio, and multiples"),
        Parameter("phase", "rad", -7.0, 7.0, 0.0, None, "phase at q = 0"),
    ),
    equation="u_motor = u + (level + depth u) sin(order q + phase)",
    reference="T. M. Jahns, W. L. Soong, IEEE Trans. Industrial Electronics 43(2), 1996",
    signature="A wave over position that grows with the torque.",
    confused_with={
        "torque_ripple": "vary the load: cogging does not grow with the torque",
        "gear_mesh_ripple": "compare orders: electrical order against teeth of the gear",
        "kinematic_error": "speed ladder: constant amplitude in torque against one in position",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "PMSM with a controller that has sensor errors"},
    wrong="One order for both parts; offsets give the first electrical order, gains the second.",
    symmetry="none", curve=("q", 0.2),
)
