"""Set-point that reaches the control law with a delay."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.delay import ORDER, DelayLine, delayed, memory_rate
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def setpoint_memory_rate(z: np.ndarray, q_d: np.ndarray, delay: PerJoint) -> np.ndarray:
    """Rate of the memory of the set-point."""
    return memory_rate(z, q_d, delay)


def late_setpoint(z: np.ndarray, q_d: np.ndarray, delay: PerJoint) -> np.ndarray:
    """Set-point that was sent `delay` seconds ago [rad]."""
    return delayed(z, q_d, delay)


SETPOINT_DELAY = Effect(
    name="setpoint_delay", family="timing", port="controller",
    build=Dynamic(setpoint_memory_rate, late_setpoint, inputs=("q_d",), outputs=("q_d",),
                  size=ORDER),
    parameters=(Parameter("delay", "s", 0.0, 10.0, 0.02, 0.0, "time from sender to law"),),
    equation="the law sees q_d(t - delay)",
    reference="A. R. Voelker, C. Eliasmith, Neural Computation 30(3), 2018 (the memory)",
    signature="The whole motion is shifted, its shape and its damping stay; nothing shows at a "
              "fixed set-point.",
    confused_with={
        "time_delay": "push with pe at a fixed set-point: a delayed set-point is then invisible",
        "in_loop_delay": "vary Kp: a delay in the loop takes damping, this one does not",
        "viscous": "ramps of several speeds: a delay lags by speed times delay at any gain",
        "setpoint_slew": "small slow motions: the limiter is invisible there, a delay is not",
    },
    simulators={
        "mujoco": "actuator nsample, delay on a position servo",
        "isaac": "DelayedPDActuator min_delay, max_delay",
        "gazebo": "none",
        "simscape": "Transport Delay in front of the controller",
    },
    wrong="As time_delay; in a continuous diagram the set-point before the start is zero, in a "
          "sampled controller it is the first one.",
    symmetry="odd", stiff=True, symbol=r"$e^{-sT}$",
    sampled=DelayLine(("q_d",), lambda t, delay: delay, longest="delay", at_rest=True),
)
