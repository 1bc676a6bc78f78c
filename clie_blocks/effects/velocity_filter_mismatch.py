"""Velocity filter with another corner than the one stated."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def corner_rate(z: np.ndarray, dq: np.ndarray, error: PerJoint, corner: PerJoint) -> np.ndarray:
    """Rate of the lagged velocity [rad/s^2]: ``corner (1 + error) (dq - z)``."""
    return corner * (1.0 + error) * (dq - z)


def corner_step(z: np.ndarray, dq: np.ndarray, error: PerJoint, corner: PerJoint,
                period: float) -> np.ndarray:
    """Lagged velocity one period later [rad/s], the velocity held meanwhile: exact."""
    return z + (1.0 - np.exp(-corner * (1.0 + error) * period)) * (dq - z)


def mismatched_velocity(z: np.ndarray, dq: np.ndarray, error: PerJoint) -> np.ndarray:
    """Velocity behind the true filter, where the stated one was expected [rad/s].

    ``(1 + error) (s + corner) / (s + corner (1 + error))``: it takes the stated corner away and
    puts the true one in its place.
    """
    return (1.0 + error) * dq - error * z


VELOCITY_FILTER_MISMATCH = Effect(
    name="velocity_filter_mismatch", family="controller", port="controller",
    build=Dynamic(corner_rate, mismatched_velocity, inputs=("dq",), outputs=("dq",)),
    parameters=(
        Parameter("error", "1", -0.99, 10.0, -0.4, 0.0, "relative error of the corner"),
        Parameter("corner", "rad/s", 0.1, 1e5, 300.0, None, "corner as stated"),
    ),
    equation="dq_law / dq = (1 + error) (s + corner) / (s + corner (1 + error))",
    reference="paper, eq. (47)",
    signature="Phase of the damping only; the stated law does not reproduce the logged u.",
    confused_with={
        "time_delay": "vary Kd: the filter acts through Kd alone",
        "actuator_lag": "vary Kd: the filter acts through Kd alone",
        "in_loop_delay": "vary Kp with Kd = 0: the filter is gone",
        "velocity_estimate_lag": "the same for the loop; compare the logged velocity",
        "gain_error": "excite below and above the corner: a gain is off at both",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Filtered derivative, time constant"},
    wrong="One of the two corners of (47); insert it twice for both. Starts at zero velocity.",
    symmetry="odd", stiff=True, symbol=r"$\frac{s+\omega_1}{s+\omega_2}$",
    sampled=Dynamic(corner_step, mismatched_velocity, inputs=("dq",), outputs=("dq",)),
)
