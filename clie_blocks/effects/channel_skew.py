"""Recorder that writes command and position of different instants into one row."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.delay import ORDER, DelayLine, delayed, memory_rate
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def skewed_record(z: np.ndarray, u: np.ndarray, skew: PerJoint) -> np.ndarray:
    """Command in the row of the log [N m]: that of `skew` seconds ago."""
    return delayed(z, u, skew)


def record_memory_rate(z: np.ndarray, u: np.ndarray, skew: PerJoint) -> np.ndarray:
    """Rate of the memory of the command."""
    return memory_rate(z, u, skew)


CHANNEL_SKEW = Effect(
    name="channel_skew", family="sensor", port="log",
    build=Dynamic(record_memory_rate, skewed_record, inputs=("u",), outputs=("u",), size=ORDER),
    parameters=(Parameter("skew", "s", 0.0, 1.0, 5e-3, 0.0,
                          "age of the command against the position in one row"),),
    equation="u_log(t) = u(t - skew)",
    reference="J. Swevers, W. Verdonck, J. De Schutter, IEEE Control Systems Magazine 27(5), 2007 "
              "(synchronous sampling)",
    signature="The loop behaves as ever; in the log torque and acceleration are out of step, with "
              "a different skew per joint.",
    confused_with={
        "time_delay": "free swing without a command: skew stays in the log",
        "in_loop_delay": "vary Kp: a delay in the loop takes damping, skew of the log does not",
        "actuator_lag": "vary Kp: a lag in the loop takes damping, skew of the log does not",
    },
    simulators={"mujoco": "sensor delay in the log alone", "isaac": "none", "gazebo": "none",
                "simscape": "Transport Delay in front of the scope"},
    wrong="As time_delay; the command before the start is zero.",
    sampled=DelayLine(("u",), lambda t, skew: skew, longest="skew"),
    symmetry="odd", stiff=True, symbol="$e^{-sT}$",
)
