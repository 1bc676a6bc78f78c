"""Torque that acts later than it is commanded."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.delay import ORDER, DelayLine, constant_delay, delayed, memory_rate
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def late_torque(z: np.ndarray, u: np.ndarray, delay: PerJoint) -> np.ndarray:
    """Torque commanded `delay` seconds ago [N m]."""
    return delayed(z, u, delay)


TIME_DELAY = Effect(
    name="time_delay", family="timing", port="drive",
    build=Dynamic(memory_rate, late_torque, inputs=("u",), outputs=("u",), size=ORDER),
    parameters=(Parameter("delay", "s", 0.0, 1.0, 5e-3, 0.0, "time from command to torque"),),
    equation="u_motor(t) = u(t - delay)",
    reference="A. R. Voelker, C. Eliasmith, Neural Computation 30(3), 2018 (the memory); K. J. "
              "Astrom, B. Wittenmark, Computer-Controlled Systems",
    signature="Pure phase lag that grows with frequency; less damping, as if Kd were smaller by "
              "Kp delay.",
    confused_with={
        "actuator_lag": "excite past 1/lag: a lag loses gain, a delay loses phase alone",
        "in_loop_delay": "compare command with torque: delayed in one case, in time in the other",
        "velocity_filter_mismatch": "vary Kd: the filter's lag acts through Kd alone",
        "tick_jitter": "spectrum: jitter has side lines next to the excitation",
        "channel_skew": "free swing without a command: skew stays in the log",
    },
    simulators={
        "mujoco": "actuator nsample, delay",
        "isaac": "DelayedPDActuator min_delay, max_delay",
        "gazebo": "none",
        "simscape": "Transport Delay",
    },
    wrong="In a continuous diagram a Pade approximant [5/6]: right within 0.5 % up to "
          "2 pi f delay = 6, with steps below delay/4; exact in a sampled controller. The torque "
          "before the start is zero.",
    symmetry="odd", stiff=True, symbol="$e^{-sT}$",
    sampled=DelayLine(("u",), constant_delay, longest="delay"),
)
