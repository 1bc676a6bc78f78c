"""Torque ripple of meshing teeth, which grows with the load."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def mesh_torque(q: np.ndarray, u: np.ndarray, sine: PerJoint, cosine: PerJoint,
                order: PerJoint, preload: PerJoint) -> np.ndarray:
    """Opposing torque of the mesh [N m].

    It is ``(preload + |u|) (sine sin(order q) + cosine cos(order q))``.
    """
    return (preload + np.abs(u)) * (sine * np.sin(order * q) + cosine * np.cos(order * q))


GEAR_MESH_RIPPLE = Effect(
    name="gear_mesh_ripple", family="transmission", port="load",
    build=Static(mesh_torque, inputs=("q", "u")),
    parameters=(
        Parameter("sine", "1", -1.0, 1.0, 0.03, 0.0, "amplitude of the sine over the torque"),
        Parameter("cosine", "1", -1.0, 1.0, 0.0, 0.0, "amplitude of the cosine over the torque"),
        Parameter("order", "1", 0.1, 1e6, 100.0, None,
                  "periods per turn of the joint: teeth times turns of the wheel"),
        Parameter("preload", "N m", 0.0, 1e3, 0.0, None,
                  "torque with which the teeth press on each other without a load"),
    ),
    equation="tau = (preload + |u|) (sine sin(order q) + cosine cos(order q))",
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
