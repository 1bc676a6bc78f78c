"""A tension spring between arm and base that carries part of the weight."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def counterbalance_torque(q: np.ndarray, moment: PerJoint, ratio: PerJoint, slack: PerJoint,
                          angle: PerJoint) -> np.ndarray:
    """Torque of a spring from a point on the base to a point on the link [N m].

    The spring has the length ``l = sqrt(1 + ratio^2 - 2 ratio cos(q - angle))`` in units of the
    distance joint-base point; the torque is the slope of its energy.
    """
    turn = q - angle
    length = np.sqrt(1.0 + ratio**2 - 2.0 * ratio * np.cos(turn))
    return moment * (1.0 - slack / length) * np.sin(turn)


COUNTERBALANCE = Effect(
    name="counterbalance", family="load", port="load",
    build=Static(counterbalance_torque, inputs=("q",)),
    parameters=(
        Parameter("moment", "N m", 0.0, 1e4, 0.3, 0.0,
                  "stiffness times both lever arms, over the gear ratio"),
        Parameter("ratio", "1", 0.01, 0.99, 0.3, None, "lever on the link over that on the base"),
        Parameter("slack", "1", 0.0, 2.0, 0.4, None, "free length over lever on the base"),
        Parameter("angle", "rad", -3.15, 3.15, 1.5707963267948966, None,
                  "joint angle at which the spring is shortest"),
    ),
    equation="tau = moment (1 - slack/l) sin(q - angle), "
             "l^2 = 1 + ratio^2 - 2 ratio cos(q - angle)",
    reference="J. L. Herder, Energy-free Systems: Theory, Conception and Design of Statically "
              "Balanced Spring Mechanisms, TU Delft, 2001, chapter 3",
    signature="Gravity that is too small or has the wrong sign, with a distorted cosine.",
    confused_with={
        "gravity": "known payload: the counterbalance does not change with it",
        "spring": "sweep the full range: a sine against a straight line",
        "hidden_compensation": "switch the drive off: a spring stays",
    },
    simulators={
        "mujoco": "spatial tendon with stiffness and springlength",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Spring and Damper Force between frames",
    },
    wrong="One spring in the plane of one joint; friction of its guides and the second joint's "
          "motion are left out.",
    passive=True, symmetry="none", side="link", curve=("q", 3.2),
)
