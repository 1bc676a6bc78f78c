"""Lost motion of a gear whose twist depends on its past."""

import numpy as np

from clie_blocks.effects.effect import Effect
from clie_blocks.effects.joint_elasticity import DAMPING
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.two_bodies import MOTOR, TwoBodies
from clie_blocks.labels import PerJoint


def slip_rate(z: np.ndarray, twist_rate: np.ndarray, reach: PerJoint) -> np.ndarray:
    """Rate of the Bouc-Wen state [1/s]: ``(w - (|w| z + w |z|) / 2) / reach``, |z| <= 1."""
    return (twist_rate - 0.5 * (np.abs(twist_rate) * z + twist_rate * np.abs(z))) / reach


def slip_step(z: np.ndarray, twist_rate: np.ndarray, reach: PerJoint,
              period: float) -> np.ndarray:
    """Bouc-Wen state a time `period` later, the rate of twist held meanwhile.

    Exact but for the instant at which it passes through zero.
    """
    travel = period * twist_rate / reach
    towards = np.where(travel < 0, -1.0, 1.0)  # the end at which it slips
    falling = towards - (towards - z) * np.exp(-np.abs(travel))
    return np.where(z * travel > 0, falling, np.clip(z + travel, -1.0, 1.0))


def hysteretic_torque(twist: np.ndarray, twist_rate: np.ndarray, z: np.ndarray, level: PerJoint,
                      stiffness: PerJoint, damping: PerJoint) -> np.ndarray:
    """Torque of spring, damper and slipping part [N m]."""
    return stiffness * twist + level * z + damping * twist_rate


def has_hysteresis(level: np.ndarray) -> np.ndarray:
    """Joints that slip inside."""
    return level > 0


TORSIONAL_HYSTERESIS = Effect(
    name="torsional_hysteresis", family="transmission", port="transmission",
    build=TwoBodies(hysteretic_torque, has_hysteresis, memory=slip_rate),
    parameters=(
        Parameter("level", "N m", 0.0, 1e3, 0.5, 0.0, "torque of the slipping part"),
        Parameter("reach", "rad", 1e-6, 0.5, 2e-4, None, "twist at which it slips"),
        Parameter("stiffness", "N m/rad", 1e-3, 1e7, 5e3, None, "stiffness beyond"),
        DAMPING, *MOTOR,
    ),
    equation="torque = stiffness twist + level z + damping twist', z' = (w - (|w| z + w |z|)/2) "
             "/ reach, w = twist'",
    reference="Y.-K. Wen, ASCE J. Engineering Mechanics 102(2), 1976; R. Dhaouadi, F. H. Ghorbel, "
              "P. S. Gandhi, IEEE Trans. Industrial Electronics 50(6), 2003",
    signature="A loop of torque over twist that does not depend on the speed; lost motion of "
              "2 level/stiffness.",
    confused_with={
        "presliding": "encoder on motor and link: friction does not twist the gear",
        "backlash": "amplitude ladder: the loop of hysteresis has no flat part",
        "joint_elasticity": "slow torque loop with a link encoder: a spring has no width",
        "maxwell_slip": "encoder on motor and link: friction does not twist the gear",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="Bouc-Wen loops inside a loop do not close; the level zero is a rigid joint, not an "
          "elastic one.",
    passive=True, symmetry="odd", stiff=True, curve=("twist", 1e-3),
)
