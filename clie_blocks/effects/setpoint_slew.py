"""Profile limiter that slows the set-point on its path to the control law."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint

UNLIMITED = 1e6


def slewed_rate(z: np.ndarray, q_d: np.ndarray, speed: np.ndarray, follow: PerJoint) -> np.ndarray:
    """Rate of the slewed set-point [rad/s]: ``clip((q_d - z) / follow, -speed, speed)``."""
    return np.where(speed < UNLIMITED, np.clip((q_d - z) / follow, -speed, speed), 0.0)


def slewed_setpoint(z: np.ndarray, q_d: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Set-point that the law sees [rad]; without a limit q_d itself."""
    return np.where(speed < UNLIMITED, z, q_d)


def slewed_step(z: np.ndarray, q_d: np.ndarray, speed: np.ndarray, period: float) -> np.ndarray:
    """Set-point that the law of a sampled controller sees [rad], and its next state."""
    moved = z + np.clip(q_d - z, -speed * period, speed * period)
    return np.where(speed < UNLIMITED, moved, q_d)


SETPOINT_SLEW = Effect(
    name="setpoint_slew", family="drive", port="controller",
    build=Dynamic(slewed_rate, slewed_setpoint, inputs=("q_d",), outputs=("q_d",)),
    parameters=(
        Parameter("speed", "rad/s", 1e-6, UNLIMITED, 1.0, UNLIMITED,
                  "largest speed of the set-point; the upper bound stands for no limit"),
        Parameter("follow", "s", 1e-4, 1.0, 2e-3, None,
                  "lag of the limiter below its limit"),
    ),
    equation="z' = clip((q_d - z) / follow, -speed, speed), the law sees z",
    reference="L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and "
              "Robots, 2008, chapter on nonlinear filters",
    signature="Every large step has the same slope, whatever its size.",
    confused_with={
        "actuator_saturation": "ladder of steps: the slope of a slewed set-point never grows",
        "torque_speed_limit": "push with pe instead of q_d: a slewed set-point does not mind",
        "time_delay": "small slow motions: the limiter is invisible there",
    },
    simulators={
        "mujoco": "actuator dcmotor slewmax",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Rate Limiter",
    },
    wrong="No limit of the acceleration; the limiter starts at q_d = 0 and lags by `follow` below "
          "its limit.",
    symmetry="odd", stiff=True, symbol=r"$|\dot{q}_d| \leq V$",
    sampled=Dynamic(slewed_step, slewed_step, inputs=("q_d",), outputs=("q_d",)),
)
