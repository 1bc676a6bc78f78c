"""Lost packets: the drive holds the last command."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def is_held(t: float, hold: PerJoint, interval: PerJoint, phase: PerJoint) -> np.ndarray:
    """Whether a packet is missing at time t: the first `hold` seconds of each interval."""
    turns = t / interval + phase
    return interval * (turns - np.floor(turns)) < hold


def held_rate(z: np.ndarray, t: float, u: np.ndarray, hold: PerJoint, interval: PerJoint,
              phase: PerJoint, settle: PerJoint) -> np.ndarray:
    """Rate of the held command [N m/s]: it follows u, and rests while packets are missing."""
    return np.where(is_held(t, hold, interval, phase) | (hold <= 0), 0.0, (u - z) / settle)


def held_torque(z: np.ndarray, t: float, u: np.ndarray, hold: PerJoint,
                interval: PerJoint, phase: PerJoint) -> np.ndarray:
    """Torque of the drive [N m]: u, or the last command while packets are missing."""
    return np.where(is_held(t, hold, interval, phase), z, u)


def last_torque(z: np.ndarray, t: float, u: np.ndarray, hold: PerJoint,
                interval: PerJoint, phase: PerJoint) -> np.ndarray:
    """Torque that the drive of a sampled controller holds [N m]: the last one that came."""
    return np.where(is_held(t, hold, interval, phase), z, u)


PACKET_HOLD = Effect(
    name="packet_hold", family="timing", port="drive",
    build=Dynamic(held_rate, held_torque, inputs=("t", "u"), outputs=("u",)),
    parameters=(
        Parameter("hold", "s", 0.0, 10.0, 0.05, 0.0, "time without packets"),
        Parameter("interval", "s", 1e-3, 1e4, 1.0, None, "time from one loss to the next"),
        Parameter("phase", "1", -2.0, 2.0, 0.0, None,
                  "share of the interval that has passed at t = 0"),
        Parameter("settle", "s", 1e-5, 0.1, 5e-4, None,
                  "age of the command that is held; above the step"),
    ),
    equation="u_motor = z while (t + phase interval) mod interval < hold, else u; "
             "z' = (u - z) / settle outside",
    reference="J. P. Hespanha, P. Naghshtabrizi, Y. Xu, Proceedings of the IEEE 95(1), 2007",
    signature="Short stretches with constant torque; kicks when the command comes back.",
    confused_with={
        "tick_jitter": "time stamps; a hold is flat while it lasts",
        "step_fault": "repeat: lost packets come back at once",
        "time_delay": "residual over time: a hold acts in stretches, a delay always",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "Sample and Hold with an enable signal"},
    wrong="Regular losses: blocks draw no random numbers. Without a phase the first hold "
          "begins at t = 0 with zero torque.",
    symmetry="odd", stiff=True, symbol="hold",
    sampled=Dynamic(last_torque, held_torque, inputs=("t", "u"), outputs=("u",)),
)
