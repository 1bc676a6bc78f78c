"""Measurement that reaches the control law with a delay."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.delay import ORDER, DelayLine, delayed, memory_rate
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def velocity_memory_rate(z: np.ndarray, q: np.ndarray, dq: np.ndarray,
                         delay: PerJoint) -> np.ndarray:
    """Rate of the memory of the velocity."""
    return memory_rate(z, dq, delay)


def late_measurement(z: np.ndarray, q: np.ndarray, dq: np.ndarray,
                     delay: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity `delay` seconds ago [rad, rad/s].

    The position follows from the mean velocity z[0] over the window, ``q - delay z[0]``, so that
    a joint at rest starts in any pose.
    """
    return q - np.where(delay > 0, delay * z[0], 0.0), delayed(z, dq, delay)


IN_LOOP_DELAY = Effect(
    name="in_loop_delay", family="timing", port="controller",
    build=Dynamic(velocity_memory_rate, late_measurement, inputs=("q", "dq"),
                  outputs=("q", "dq"), size=ORDER),
    parameters=(Parameter("delay", "s", 0.0, 1.0, 5e-3, 0.0,
                          "time from measurement to control law"),),
    equation="the law sees q(t - delay), dq(t - delay)",
    reference="K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, section on delays",
    signature="Less damping, ringing that grows with Kp; the log's own q and u disagree with the "
              "stated law by the delay.",
    confused_with={
        "time_delay": "replay the law on the logged q: only a delay of the measurement shows",
        "actuator_lag": "replay the law on the logged q: the lag comes after it",
        "velocity_filter_mismatch": "vary Kp with Kd = 0: a filter of the velocity is gone",
        "channel_skew": "vary Kp: a delay in the loop takes damping, skew of the log does not",
        "velocity_estimate_lag": "vary Kp with Kd = 0: a lag of the velocity is gone",
    },
    simulators={
        "mujoco": "sensor nsample, delay",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Transport Delay",
    },
    wrong="As time_delay; the joint was at rest before the start.",
    symmetry="odd", stiff=True, symbol="$e^{-sT}$",
    sampled=DelayLine(("q", "dq"), lambda t, delay: delay, longest="delay", at_rest=True),
)
