"""A mass at the end of a planar arm."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.chain import absolute, onto_joints
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint
from clie_blocks.manipulator import GRAVITY


def payload_terms(q: np.ndarray, dq: np.ndarray, mass: PerJoint, length: PerJoint,
                  gear_ratio: np.ndarray, gravity: PerJoint = GRAVITY,
                  ) -> tuple[np.ndarray, np.ndarray]:
    """Inertia [kg m^2] and torque [N m] of a mass at the tip, motor side.

    With the tip's Jacobian J the inertia is ``m J^T J / r`` and the torque
    ``m J^T (J' dq + g) / r``: centrifugal, Coriolis and weight.
    """
    angle, rate = absolute(q), absolute(dq)
    x, y = length * np.cos(angle), length * np.sin(angle)
    jacobian_x, jacobian_y = -onto_joints(y), onto_joints(x)
    pull_x = -absolute(x * rate**2)[..., -1:]
    pull_y = gravity - absolute(y * rate**2)[..., -1:]
    squared = (jacobian_x[..., :, None] * jacobian_x[..., None, :]
               + jacobian_y[..., :, None] * jacobian_y[..., None, :])
    torque = mass * (jacobian_x * pull_x + jacobian_y * pull_y) / gear_ratio
    return mass * squared / gear_ratio[..., :, None], torque


PAYLOAD = Effect(
    name="payload", family="load", port="body",
    build=Static(payload_terms, inputs=("q", "dq"), outputs=("inertia", "tau")),
    parameters=(
        Parameter("mass", "kg", 0.0, 1e3, 0.5, 0.0, "mass at the tip", per_joint=False),
        Parameter("length", "m", 0.0, 10.0, 0.6, None, "length of each link"),
        Parameter("gear_ratio", "1", 0.1, 1e4, 100.0, None, "motor turns per joint turn"),
        Parameter("gravity", "m/s^2", 0.0, 30.0, GRAVITY, None,
                  "gravity in the plane of the arm; 0 where it lies level", per_joint=False),
    ),
    equation="inertia = m J^T J / r, tau = m J^T (J' dq + g) / r with the tip's Jacobian J",
    reference="M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, chapter 7",
    signature="Gravity and inertia together: torque by pose, and more torque for the same "
              "acceleration.",
    confused_with={
        "gravity": "fast motion: a payload adds inertia as well",
        "inertia": "hold at several poses: a payload also weighs",
        "torque_gain_error": "hold at rest: an error of the gain scales with the torque",
        "coupling": "move one joint alone: a payload still acts",
    },
    simulators={
        "mujoco": "body mass and ipos",
        "isaac": "link mass and centre of mass",
        "gazebo": "<inertial>",
        "simscape": "Solid or Point Mass",
    },
    wrong="A point mass on a planar arm; with a transmission the mass sits on the link.",
    passive=True, symmetry="none", per_joint=False, side="link",
)
