"""Command in steps: the resolution of a digital drive."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint
from clie_blocks.measurement import quantized


def stepped_torque(u: np.ndarray, resolution: PerJoint) -> np.ndarray:
    """Torque rounded to steps of the drive [N m]."""
    return quantized(u, resolution)


TORQUE_QUANTIZATION = Effect(
    name="torque_quantization", family="drive", port="drive",
    build=Static(stepped_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("resolution", "N m", 0.0, 100.0, 0.05, 0.0, "step: range / 2^bits"),
    ),
    equation="u_motor = resolution floor(u / resolution + 1/2)",
    reference="G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems, "
              "chapter on quantization",
    signature="The torque moves in steps; small limit cycles about rest.",
    confused_with={
        "encoder_quantization": "histograms of command and position: which one has steps",
        "dead_zone": "histogram of the command: many steps against one",
        "coulomb": "histogram of the command; friction has no steps",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "Quantizer"},
    wrong="Rounds half upwards, so that it is odd but for the edges of its steps.",
    symmetry="none", stiff=True, curve=("u", 0.15),
)
