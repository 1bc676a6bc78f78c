"""Velocity estimate of the drive that lags behind the joint."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.lag import lag_rate, lag_step, lagged
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def lagging_velocity(z: np.ndarray, dq: np.ndarray, lag: PerJoint) -> np.ndarray:
    """Velocity estimate [rad/s]: ``lag v' = dq - v``."""
    return lagged(z, dq, lag)


VELOCITY_ESTIMATE_LAG = Effect(
    name="velocity_estimate_lag", family="sensor", port="sensor",
    build=Dynamic(lag_rate, lagging_velocity, inputs=("dq",), outputs=("dq",)),
    parameters=(Parameter("lag", "s", 0.0, 1.0, 5e-3, 0.0, "time constant"),),
    equation="dq_measured = dq / (1 + lag s)",
    reference="P. R. Belanger, P. Dobrovolny, A. Helmy, X. Zhang, Int. J. Robotics Research "
              "17(11), 1998",
    signature="The logged velocity lags behind the difference of the logged position; less "
              "damping.",
    confused_with={
        "velocity_filter_mismatch": "the same for the loop; compare the logged velocity",
        "in_loop_delay": "vary Kp with Kd = 0: a lag of the velocity is gone",
        "time_delay": "vary Kd: the lag acts through Kd alone",
        "actuator_lag": "vary Kd: the lag acts through Kd alone",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Filtered derivative, time constant"},
    wrong="First order; observers and multi-tap differences have another phase.",
    symmetry="odd", stiff=True, symbol=r"$\frac{1}{1+Ts}$",
    sampled=Dynamic(lag_step, lagging_velocity, inputs=("dq",), outputs=("dq",)),
)
