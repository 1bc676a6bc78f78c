"""Gear that stiffens under load, as harmonic drives do."""

import numpy as np

from clie_blocks.effects.effect import Effect
from clie_blocks.effects.joint_elasticity import DAMPING, is_elastic
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.two_bodies import MOTOR, TwoBodies
from clie_blocks.labels import PerJoint


def stiffening_torque(twist: np.ndarray, twist_rate: np.ndarray, compliance: PerJoint,
                      stiffening: PerJoint, knee: PerJoint, damping: PerJoint) -> np.ndarray:
    """Torque of a spring that stiffens [N m].

    The stiffness rises from ``k = 1/compliance`` to ``k (1 + stiffening)``, and is halfway there
    at the twist at which a spring of stiffness k has the torque `knee`: a cubic spring well below
    that twist, a linear one well beyond.
    """
    safe = np.where(compliance > 0, compliance, 1.0)
    bend = knee * safe
    beyond = twist - bend * np.arctan(twist / bend)
    return (twist + stiffening * beyond) / safe + damping * twist_rate


STIFFENING_ELASTICITY = Effect(
    name="stiffening_elasticity", family="transmission", port="transmission",
    build=TwoBodies(stiffening_torque, is_elastic),
    parameters=(
        Parameter("compliance", "rad/(N m)", 0.0, 10.0, 3e-4, 0.0,
                  "twist per torque of the motor when soft"),
        Parameter("stiffening", "1", 0.0, 100.0, 1.0, None,
                  "relative gain of stiffness far beyond the knee"),
        Parameter("knee", "N m", 1e-6, 1e4, 1.0, None,
                  "torque of the soft spring at the twist where half of the gain is reached"),
        DAMPING, *MOTOR,
    ),
    equation="torque = (twist + stiffening (twist - w atan(twist / w))) / compliance + "
             "damping twist', w = knee compliance",
    reference="Harmonic Drive, technical data: stiffness K1, K2, K3 at the torques T1, T2; T. D. "
              "Tuttle, W. P. Seering, IEEE Trans. Robotics and Automation 12(3), 1996",
    signature="As joint_elasticity, with a resonance that rises with the static load.",
    confused_with={
        "joint_elasticity": "sweeps at several static loads: a linear spring keeps its peak",
        "backlash": "small torques: a soft gear still carries, a gap does not",
        "torsional_hysteresis": "slow torque loop with a link encoder: a spring has no width",
    },
    simulators={
        "mujoco": "extra hinge, stiffness with polynomial coefficients",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "Nonlinear Rotational Spring",
    },
    wrong="One smooth knee where catalogues give stiffnesses between two corners; no hysteresis.",
    passive=True, symmetry="odd", stiff=True, curve=("twist", 1e-3),
)
