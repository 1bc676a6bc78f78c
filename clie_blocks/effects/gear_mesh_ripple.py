"""Torque ripple of meshing teeth, which grows with the load."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def mesh_torque(q: np.ndarray, u: np.ndarray, level: PerJoint, depth: PerJoint, order: PerJoint,
                phase: PerJoint) -> np.ndarray:
    """Torque of the mesh [N m], opposing: ``(level + depth |u|) sin(order q + phase)``."""
    return (level + depth * np.abs(u)) * np.sin(order * q + phase)


GEAR_MESH_RIPPLE = Effect(
    name="gear_mesh_ripple", family="transmission", port="load",
    build=Static(mesh_torque, inputs=("q", "u")),
    parameters=(
        Parameter("depth", "1", 0.0, 1.0, 0.03, 0.0, "share of the torque that ripples"),
        Parameter("level", "N m", 0.0, 100.0, 0.01, 0.0, "ripple without load"),
        Parameter("order", "1", 0.1, 1e6, 100.0, None,
                  "periods per turn of the joint: teeth times turns of the wheel"),
        Parameter("phase", "rad", -7.0, 7.0, 0.0, None, "phase at q = 0"),
    ),
    equation="tau = (level + depth |u|) sin(order q + phase)",
    reference="D. R. Houser, G. W. Blankenship, SAE 891869, 1989; J. D. Smith, Gear Noise and "
              "Vibration, chapter 1",
    signature="A wave over position that grows with the load.",
    confused_with={
        "torque_ripple": "vary the load: cogging does not grow with the torque",
        "commutation_ripple": "compare orders: teeth of the gear against electrical order",
        "kinematic_error": "vary the load: a kinematic error does not grow with it",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Simple Gear with meshing stiffness"},
    wrong="The motor's torque stands for the load of the teeth; one harmonic.",
    symmetry="none", curve=("q", 0.2),
)
