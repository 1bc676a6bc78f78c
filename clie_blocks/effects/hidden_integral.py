"""Integral action that nobody mentioned."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def error_rate(z: np.ndarray, q_d: np.ndarray, q: np.ndarray, u: np.ndarray, ki: PerJoint,
               clamp: PerJoint) -> np.ndarray:
    """Rate of the integral z of the error [rad]; it stops where ``ki z`` leaves the clamp."""
    error = q_d - q
    stuck = (ki * np.abs(z) >= clamp) & (z * error > 0)
    return np.where((ki > 0) & ~stuck, error, 0.0)


def error_sum(z: np.ndarray, q_d: np.ndarray, q: np.ndarray, u: np.ndarray, ki: PerJoint,
              clamp: PerJoint, period: float) -> np.ndarray:
    """Integral of the error one period later [rad s]: a sum, as drives take it."""
    return z + period * error_rate(z, q_d, q, u, ki, clamp)


def integral_torque(z: np.ndarray, q_d: np.ndarray, q: np.ndarray, u: np.ndarray, ki: PerJoint,
                    clamp: PerJoint) -> np.ndarray:
    """Torque with integral action [N m]: ``u + clip(ki z, -clamp, clamp)``."""
    return u + np.clip(ki * z, -clamp, clamp)


HIDDEN_INTEGRAL = Effect(
    name="hidden_integral", family="controller", port="controller",
    build=Dynamic(error_rate, integral_torque, inputs=("q_d", "q", "u"), outputs=("u",)),
    parameters=(
        Parameter("ki", "N m/(rad s)", 0.0, 1e5, 5.0, 0.0, "integral gain"),
        Parameter("clamp", "N m", 0.0, 1e4, 5.0, None, "largest torque of the integral"),
    ),
    equation="u = law + clip(ki z, -clamp, clamp), z' = q_d - q",
    reference="K. J. Astrom, T. Hagglund, Advanced PID Control, 2006",
    signature="No error at rest under load, slow creep after a step, hunting with friction.",
    confused_with={
        "presliding": "hold for long: an integral removes the error at rest",
        "hidden_compensation": "load step: an integral needs time to answer",
        "friction_drift": "repeat from rest: the integral starts anew",
        "offset": "read the command: the integral shows in u",
    },
    simulators={
        "mujoco": "plugin mujoco.pid, ki",
        "isaac": "PID controller of the application",
        "gazebo": "<i_gain>",
        "simscape": "PID Controller",
    },
    wrong="Conditional integration at the clamp; other drives wind back in other ways.",
    symmetry="odd", stiff=True, symbol=r"$\frac{1}{s}$",
    sampled=Dynamic(error_sum, integral_torque, inputs=("q_d", "q", "u"), outputs=("u",)),
)
