"""Drag of the links in air or water."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.chain import GEAR_RATIO, absolute, onto_joints
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def fluid_drag_torque(dq: np.ndarray, drag: PerJoint, gear_ratio: PerJoint = 1.0) -> np.ndarray:
    """Drag torque of joint k [N m]: sum_(j >= k) drag_j w_j |w_j| / r_k, absolute rates w."""
    rate = absolute(dq)
    return onto_joints(drag * rate * np.abs(rate)) / gear_ratio


FLUID_DRAG = Effect(
    name="fluid_drag", family="load", port="load",
    build=Static(fluid_drag_torque, inputs=("dq",)),
    parameters=(
        Parameter("drag", "N m s^2/rad^2", 0.0, 100.0, 0.01, 0.0,
                  "drag of each link over its squared rate of turn"),
        GEAR_RATIO,
    ),
    equation="tau_k = 1/r_k sum over j >= k of drag_j w_j |w_j|, w_j = dq_0 + ... + dq_j",
    reference="T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, Wiley "
              "2011",
    signature="As quadratic drag, but felt when the joints before turn the link.",
    confused_with={
        "quadratic_drag": "turn the joints before it: only fluid drag feels that",
        "viscous": "speed ladder over a factor of four",
        "coupling": "constant speed of all joints: inertia fades, drag stays",
    },
    simulators={
        "mujoco": "option density, viscosity; joint damping polynomial",
        "isaac": "none",
        "gazebo": "hydrodynamics plugin",
        "simscape": "none",
    },
    wrong="Each link feels its own turning rate, not the travel of its base; added mass of the "
          "fluid is left out.",
    passive=True, symmetry="odd", per_joint=False, side="link", curve=("dq", 3.0),
)
