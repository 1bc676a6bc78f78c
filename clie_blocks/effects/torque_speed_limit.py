"""Torque-speed envelope of a motor at a limited voltage."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def enveloped_torque(u: np.ndarray, dq: np.ndarray, peak: PerJoint, droop: PerJoint) -> np.ndarray:
    """Torque within the envelope of a voltage-limited motor [N m].

    Between ``-peak clip(1 + droop dq, 0, 1)`` and ``peak clip(1 - droop dq, 0, 1)``: driving
    torque falls to zero at the no-load speed 1/droop, braking torque does not.
    """
    falling = np.clip(droop * dq, -1.0, 1.0)
    lower, upper = -np.minimum(1.0 + falling, 1.0), np.minimum(1.0 - falling, 1.0)
    return np.clip(u, peak * lower, peak * upper)


TORQUE_SPEED_LIMIT = Effect(
    name="torque_speed_limit", family="drive", port="drive",
    build=Static(enveloped_torque, inputs=("u", "dq"), outputs=("u",)),
    parameters=(
        Parameter("peak", "N m", 0.0, 1e6, 5.0, 1e6,
                  "torque at standstill; the upper bound stands for no limit"),
        Parameter("droop", "s/rad", 0.0, 100.0, 0.3, 0.0, "one over the no-load speed"),
    ),
    equation="-peak clip(1 + droop dq, 0, 1) <= u_motor <= peak clip(1 - droop dq, 0, 1)",
    reference="A. Hughes, B. Drury, Electric Motors and Drives, chapter 3; Isaac Lab, DCMotor "
              "actuator model",
    signature="Torque is missing at high speed while it accelerates, not while it brakes.",
    confused_with={
        "actuator_saturation": "same torque at low speed: the envelope bites at speed only",
        "quadratic_drag": "coast and brake at speed: drag acts in all four quadrants",
        "back_emf": "small torques at high speed: the envelope does not touch them",
    },
    simulators={
        "mujoco": "actuator dcmotor nominal, Vmax",
        "isaac": "DCMotorCfg saturation_effort, velocity_limit",
        "gazebo": "<limit><velocity>",
        "simscape": "Motor & Drive (System Level), torque-speed envelope",
    },
    wrong="No field weakening, and the supply is stiff; past the no-load speed the driving torque "
          "is zero instead of negative.",
    symmetry="odd", stiff=True, curve=("u", 15.0),
)
