"""Encoder disc off its centre."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def eccentric_measurement(q: np.ndarray, dq: np.ndarray, sine: PerJoint, cosine: PerJoint,
                          order: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of an off-centre encoder: ``q + amplitude sin(order q + phase)``."""
    angle = order * q
    error = sine * np.sin(angle) + cosine * np.cos(angle)
    slope = order * (sine * np.cos(angle) - cosine * np.sin(angle))
    return q + error, dq + slope * dq


ENCODER_ECCENTRICITY = Effect(
    name="encoder_eccentricity", family="sensor", port="sensor",
    build=Static(eccentric_measurement, inputs=("q", "dq"), outputs=("q", "dq")),
    parameters=(
        Parameter("sine", "rad", -0.5, 0.5, 2e-3, 0.0, "error at the joint, part of the sine"),
        Parameter("cosine", "rad", -0.5, 0.5, 0.0, 0.0, "part of the cosine"),
        Parameter("order", "1", 0.1, 1e4, 8.0, None,
                  "turns of the encoder shaft per turn of the joint; twice that for the second "
                  "harmonic"),
    ),
    equation="q_measured = q + sine sin(order q) + cosine cos(order q)",
    reference="Heidenhain, Angle Encoders (technical information): error by eccentricity of the "
              "graduation",
    signature="A wave over position with an amplitude in position that no speed changes.",
    confused_with={
        "kinematic_error": "order: whole turns of the encoder against those of the gear",
        "torque_ripple": "speed ladder: constant amplitude in position against one in torque",
        "position_dependent_friction": "same path both ways: friction changes sign",
        "encoder_offset": "several poses: an offset is the same everywhere",
        "gravity": "fast sweep: the sensor's wave stays in position",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="One harmonic.",
    symmetry="none", curve=("q", 1.6),
)
