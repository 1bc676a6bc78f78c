"""Dead zone of a drive: small commands are lost."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def dead_zone_torque(u: np.ndarray, width: PerJoint, jump: PerJoint) -> np.ndarray:
    """Torque of a drive that ignores commands up to width [N m].

    Beyond it ``u - (1 - jump) width sgn u``: with jump 0 the rest of the command, with jump 1
    the whole of it.
    """
    lost = np.clip(u, -width, width)
    return u - np.where(np.abs(u) > width, (1.0 - jump) * lost, lost)


DEAD_ZONE = Effect(
    name="dead_zone", family="drive", port="drive",
    build=Static(dead_zone_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("width", "N m", 0.0, 1e3, 0.2, 0.0, "largest command that is ignored"),
        Parameter("jump", "1", 0.0, 1.0, 0.0, None,
                  "share of the width that returns at once beyond it"),
    ),
    equation="u_motor = 0 for |u| <= width, else u - (1 - jump) width sgn u",
    reference="A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions, 1968, table B.1",
    signature="An error at rest of up to width/Kp and a loop that is slack for small motions.",
    confused_with={
        "coulomb": "brake a joint that coasts without a command: friction slows it, a dead zone "
                   "does not",
        "backlash": "vary Kp: width/Kp scales, a gap does not",
        "torque_quantization": "histogram of the command; a dead zone has one step only",
        "hidden_integral": "hold for long: an integral removes the error at rest",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "Dead Zone"},
    wrong="Real dead zones of PWM drives depend on the direction of the current.",
    symmetry="odd", stiff=True, curve=("u", 1.0),
)
