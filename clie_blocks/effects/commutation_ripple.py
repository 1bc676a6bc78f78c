"""Torque ripple of commutation and current sensing."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def rippled_torque(u: np.ndarray, q: np.ndarray, sine: PerJoint, cosine: PerJoint,
                   order: PerJoint) -> np.ndarray:
    """Torque with ripple [N m]: ``u (1 + sine sin(order q) + cosine cos(order q))``."""
    return u + u * (sine * np.sin(order * q) + cosine * np.cos(order * q))


COMMUTATION_RIPPLE = Effect(
    name="commutation_ripple", family="drive", port="drive",
    build=Static(rippled_torque, inputs=("u", "q"), outputs=("u",)),
    parameters=(
        Parameter("sine", "1", -1.0, 1.0, 0.05, 0.0,
                  "amplitude of the sine over the torque: unequal gains of the current sensors"),
        Parameter("cosine", "1", -1.0, 1.0, 0.0, 0.0, "amplitude of the cosine, likewise"),
        Parameter("order", "1", 0.1, 1e5, 100.0, None,
                  "periods per turn of the joint: pole pairs times gear ratio, and multiples"),
    ),
    equation="u_motor = u (1 + sine sin(order q) + cosine cos(order q))",
    reference="T. M. Jahns, W. L. Soong, IEEE Trans. Industrial Electronics 43(2), 1996",
    signature="A wave over position that grows with the torque.",
    confused_with={
        "torque_ripple": "vary the load: cogging does not grow with the torque",
        "gear_mesh_ripple": "compare orders: electrical order against teeth of the gear",
        "kinematic_error": "speed ladder: constant amplitude in torque against one in position",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "PMSM with a controller that has sensor errors"},
    wrong="One harmonic. Offsets of the current sensors ripple without a load: torque_ripple.",
    symmetry="none", curve=("q", 0.2),
)
