"""Drive whose torque changes by so much per second at most."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint

UNLIMITED = 1e9


def slewed_torque_rate(z: np.ndarray, u: np.ndarray, rate: np.ndarray,
                       follow: PerJoint) -> np.ndarray:
    """Rate of the torque [N m/s]: ``clip((u - z) / follow, -rate, rate)``."""
    return np.where(rate < UNLIMITED, np.clip((u - z) / follow, -rate, rate), 0.0)


def slewed_torque(z: np.ndarray, u: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Torque of the motor [N m]; without a limit the command itself."""
    return np.where(rate < UNLIMITED, z, u)


def slewed_torque_step(z: np.ndarray, u: np.ndarray, rate: np.ndarray,
                       period: float) -> np.ndarray:
    """Torque after a period in which the command u is held [N m]."""
    return np.where(rate < UNLIMITED, z + np.clip(u - z, -rate * period, rate * period), u)


def mean_slewed_torque(z: np.ndarray, u: np.ndarray, rate: np.ndarray,
                       period: float) -> np.ndarray:
    """Mean torque [N m] over a period in which the command u is held."""
    after = slewed_torque_step(z, u, rate, period)
    ramped = np.where(rate < UNLIMITED, np.abs(after - z) / (rate * period), 0.0)
    return after - 0.5 * ramped * (after - z)


TORQUE_SLEW = Effect(
    name="torque_slew", family="drive", port="drive",
    build=Dynamic(slewed_torque_rate, slewed_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("rate", "N m/s", 1e-9, UNLIMITED, 100.0, UNLIMITED,
                  "largest change of the torque; the upper bound stands for no limit"),
        Parameter("follow", "s", 1e-5, 1.0, 1e-3, None, "lag of the limiter below its limit"),
    ),
    equation="z' = clip((u - z) / follow, -rate, rate), u_motor = z",
    reference="L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and "
              "Robots, 2008, chapter on nonlinear filters",
    signature="The torque is late after large quick changes of the command, and only then.",
    confused_with={
        "actuator_lag": "small quick motions: a lag is there at any size, a limited rate is not",
        "packet_hold": "repeat one motion: lost packets do not follow the command",
        "actuator_saturation": "large slow torques: a limited rate reaches them",
        "setpoint_slew": "compare command and torque: a slewed set-point moves both",
    },
    simulators={
        "mujoco": "none",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Rate Limiter",
    },
    wrong="The same limit up and down; it starts at zero torque and lags by `follow` below its "
          "limit.",
    symmetry="odd", stiff=True, symbol=r"$|\dot{u}| \leq R$",
    sampled=Dynamic(slewed_torque_step, mean_slewed_torque, inputs=("u",), outputs=("u",)),
)
