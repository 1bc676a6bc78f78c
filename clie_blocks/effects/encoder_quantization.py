"""Resolution of an encoder."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint
from clie_blocks.measurement import quantized


def counted_position(q: np.ndarray, resolution: PerJoint) -> np.ndarray:
    """Position in whole steps of the encoder [rad]."""
    return quantized(q, resolution)


ENCODER_QUANTIZATION = Effect(
    name="encoder_quantization", family="sensor", port="sensor",
    build=Static(counted_position, inputs=("q",), outputs=("q",)),
    parameters=(
        Parameter("resolution", "rad", 0.0, 1.0, 1.5e-3, 0.0, "step: 2 pi / 2^bits"),
    ),
    equation="q_measured = resolution floor(q / resolution + 1/2)",
    reference="R. J. E. Merry, M. J. G. van de Molengraft, M. Steinbuch, Mechatronics 20(1), 2010",
    signature="Steps in q, spikes of resolution/period in a velocity made from it.",
    confused_with={
        "torque_quantization": "histograms of command and position: which one has steps",
        "backlash": "histogram of q; vary Kp: steps stay where they are",
        "dead_zone": "histogram of q",
        "coulomb": "histogram of q: friction stops anywhere",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "Quantizer"},
    wrong="Even steps; the velocity of the block stays smooth, so take it from q with a filter "
          "in the diagram to see the spikes.",
    symmetry="none", stiff=True, curve=("q", 5e-3),
)
