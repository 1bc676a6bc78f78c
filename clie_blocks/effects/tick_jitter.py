"""Ticks of the drive that beat against those of the controller."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.delay import ORDER, DelayLine, memory_rate, recalled
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def torque_memory_rate(z: np.ndarray, t: float, u: np.ndarray, spread: PerJoint) -> np.ndarray:
    """Rate of the memory of the torque."""
    return memory_rate(z, u, spread)


def beating_torque(z: np.ndarray, t: float, u: np.ndarray, spread: PerJoint, beat: PerJoint,
                   phase: PerJoint) -> np.ndarray:
    """Torque commanded ``spread frac(beat t + phase)`` seconds ago [N m]."""
    return recalled(z, u, spread, saw_tooth(t, beat, phase))


def saw_tooth(t: float, beat: PerJoint, phase: PerJoint) -> np.ndarray:
    """Share of the beat that has passed, 0 to 1."""
    turns = beat * t + phase
    return turns - np.floor(turns)


def beating_delay(t: float, spread: PerJoint, beat: PerJoint, phase: PerJoint) -> np.ndarray:
    """Delay of the torque [s]."""
    return spread * saw_tooth(t, beat, phase)


TICK_JITTER = Effect(
    name="tick_jitter", family="timing", port="drive",
    build=Dynamic(torque_memory_rate, beating_torque, inputs=("t", "u"), outputs=("u",),
                  size=ORDER),
    parameters=(
        Parameter("spread", "s", 0.0, 1.0, 4e-3, 0.0, "largest delay, about one tick"),
        Parameter("beat", "Hz", 1e-3, 1e3, 7.3, None, "difference of the two clocks' rates"),
        Parameter("phase", "1", -2.0, 2.0, 0.0, None,
                  "share of the beat that has passed at t = 0"),
    ),
    equation="u_motor(t) = u(t - spread frac(beat t + phase))",
    reference="J. Nilsson, Real-Time Control Systems with Delays, Lund, 1998",
    signature="A mean delay of spread/2; side lines at the beat's distance from the excitation.",
    confused_with={
        "time_delay": "spectrum: jitter has side lines next to the excitation",
        "packet_hold": "time stamps; a hold is flat while it lasts",
        "actuator_lag": "spectrum: a lag is linear and has no lines of its own",
    },
    simulators={"mujoco": "none", "isaac": "decimation of the controller", "gazebo": "update_rate",
                "simscape": "Variable Transport Delay"},
    wrong="A regular saw-tooth: blocks draw no random numbers, so random jitter must come as an "
          "input of the diagram. Below that, as time_delay.",
    symmetry="odd", stiff=True, symbol="$e^{-sT(t)}$",
    sampled=DelayLine(("u",), beating_delay, longest="spread"),
)
