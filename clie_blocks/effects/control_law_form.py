"""Law that damps the velocity error where the velocity was expected."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def reference_rate(z: np.ndarray, q_d: np.ndarray, dq: np.ndarray, corner: PerJoint) -> np.ndarray:
    """Rate of the smoothed set-point z [rad/s]: ``corner (q_d - z)``."""
    return corner * (q_d - z)


def velocity_error(z: np.ndarray, q_d: np.ndarray, dq: np.ndarray, share: PerJoint,
                   corner: PerJoint) -> np.ndarray:
    """Velocity that the law damps [rad/s]: ``dq - share dq_d``, dq_d by a filtered derivative."""
    return dq - share * corner * (q_d - z)


def reference_step(z: np.ndarray, q_d: np.ndarray, dq: np.ndarray, corner: PerJoint,
                   period: float) -> np.ndarray:
    """Smoothed set-point one period later [rad], the set-point held meanwhile."""
    return z + _share_followed(corner, period) * (q_d - z)


def sampled_velocity_error(z: np.ndarray, q_d: np.ndarray, dq: np.ndarray, share: PerJoint,
                           corner: PerJoint, period: float) -> np.ndarray:
    """Velocity that a sampled law damps [rad/s]: the step of z over the period is its dq_d."""
    return dq - share * _share_followed(corner, period) / period * (q_d - z)


def _share_followed(corner: PerJoint, period: float) -> np.ndarray:
    return 1.0 - np.exp(-corner * period)


CONTROL_LAW_FORM = Effect(
    name="control_law_form", family="controller", port="controller",
    build=Dynamic(reference_rate, velocity_error, inputs=("q_d", "dq"), outputs=("dq",)),
    parameters=(
        Parameter("share", "1", -1.0, 2.0, 1.0, 0.0,
                  "share of the set-point's velocity that the law knows"),
        Parameter("corner", "rad/s", 0.1, 1e4, 200.0, None, "corner of its derivative"),
    ),
    equation="u = Kp (q_d - q) + Kd (share dq_d - dq) + pe, dq_d = corner s/(s + corner) q_d",
    reference="B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics, section 8.5",
    signature="A residual along the velocity of the set-point: no ramp lag where one is expected.",
    confused_with={
        "viscous": "move with pe at a fixed set-point: the form of the law is then invisible",
        "gain_error": "fixed set-point: an error of Kd stays",
        "time_delay": "fixed set-point: a delay stays",
        "setpoint_slew": "small slow ramps: the limiter is invisible there",
    },
    simulators={
        "mujoco": "actuator biasprm; position against intvelocity",
        "isaac": "velocity target of the drive",
        "gazebo": "none",
        "simscape": "PID Controller (2DOF), derivative weight c",
    },
    wrong="The derivative starts from q_d = 0 and has a lag of 1/corner.",
    symmetry="odd", stiff=True,
    sampled=Dynamic(reference_step, sampled_velocity_error, inputs=("q_d", "dq"),
                    outputs=("dq",)),
)
