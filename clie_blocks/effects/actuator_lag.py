"""Lag of the current loop between command and torque."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.lag import lag_rate, lag_step, lagged, mean_lagged
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def lagging_torque(z: np.ndarray, u: np.ndarray, lag: PerJoint) -> np.ndarray:
    """Torque behind a first-order lag [N m]: ``lag u_motor' = u - u_motor``."""
    return lagged(z, u, lag)


def mean_lagging_torque(z: np.ndarray, u: np.ndarray, lag: PerJoint,
                        period: float) -> np.ndarray:
    """Mean torque [N m] over a period in which the command u is held."""
    return mean_lagged(z, u, lag, period)


ACTUATOR_LAG = Effect(
    name="actuator_lag", family="drive", port="drive",
    build=Dynamic(lag_rate, lagging_torque, inputs=("u",), outputs=("u",)),
    parameters=(Parameter("lag", "s", 0.0, 10.0, 5e-3, 0.0, "time constant"),),
    equation="u_motor = u / (1 + lag s)",
    reference="W. Leonhard, Control of Electrical Drives, section on current control",
    signature="Less torque and more phase lag at high frequency; the loop is less damped.",
    confused_with={
        "time_delay": "excite past 1/lag: a lag loses gain, a delay loses phase alone",
        "in_loop_delay": "excite past 1/lag and compare command with torque",
        "velocity_filter_mismatch": "vary Kd: the filter's lag acts through Kd alone",
        "joint_elasticity": "excite past the resonance: a lag has no peak",
        "velocity_estimate_lag": "vary Kd: the estimate's lag acts through Kd alone",
    },
    simulators={
        "mujoco": "actuator dyntype filter, dynprm; dcmotor inductance",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "DC Motor, armature inductance",
    },
    wrong="First order and linear: a current loop overshoots and runs into its voltage limit. "
          "Starts at zero torque. Lags below the step need a smaller step.",
    symmetry="odd", stiff=True, symbol=r"$\frac{1}{1+Ts}$",
    sampled=Dynamic(lag_step, mean_lagging_torque, inputs=("u",), outputs=("u",)),
)
