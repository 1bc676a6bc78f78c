"""Transmission error of a gear: the link runs ahead and behind once per so many degrees."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def wobbling_link(q: np.ndarray, dq: np.ndarray, sine: PerJoint, cosine: PerJoint,
                  order: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of a link [rad, rad/s] that runs ahead and behind in a wave."""
    s, c = np.sin(order * q), np.cos(order * q)
    return q + sine * s + cosine * c, dq + order * (sine * c - cosine * s) * dq


KINEMATIC_ERROR = Effect(
    name="kinematic_error", family="transmission", port="transmission",
    build=Static(wobbling_link, inputs=("q", "dq"), outputs=("q", "dq")),
    parameters=(
        Parameter("sine", "rad", -0.1, 0.1, 3e-4, 0.0, "amplitude of the sine, at the link"),
        Parameter("cosine", "rad", -0.1, 0.1, 0.0, 0.0, "amplitude of the cosine, at the link"),
        Parameter("order", "1", 0.1, 1e5, 200.0, None,
                  "periods per turn of the joint: twice the ratio of a harmonic drive"),
    ),
    equation="q_link = q + sine sin(order q) + cosine cos(order q)",
    reference="T. D. Tuttle, W. P. Seering, IEEE Trans. Robotics and Automation 12(3), 1996",
    signature="A line at twice the motor's speed, constant in position; it shakes the joint when "
              "it meets the resonance.",
    confused_with={
        "encoder_eccentricity": "order: turns of the gear against whole turns of the encoder",
        "torque_ripple": "speed ladder: constant amplitude in position against one in torque",
        "gear_mesh_ripple": "vary the load: a kinematic error does not grow with it",
        "ratio_error": "sweep far: an error of the ratio grows with the travel",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="The motor does not feel the link's wobble (small for a large ratio); one harmonic.",
    symmetry="none", curve=("q", 0.1),
)
