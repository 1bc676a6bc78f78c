"""Coulomb (dry) friction of a joint, smoothed at rest."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def coulomb_limits(dq: np.ndarray, level: PerJoint) -> tuple[PerJoint, PerJoint]:
    """Largest friction torque [N m], the same against both directions of motion."""
    return level, level


COULOMB = Effect(
    name="coulomb", family="friction", port="load",
    build=dry_friction(coulomb_limits, inputs=("dq",)),
    parameters=(
        Parameter("level", "N m", 0.0, 100.0, 0.05, 0.0, "friction torque of a moving joint"),
        WIDTH,
    ),
    equation="tau = level tanh(dq / width)",
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994",
    signature="A step of torque at each reversal of the velocity; an error at rest of up to "
              "level/Kp; the lag behind a sine falls as its amplitude grows.",
    confused_with={
        "viscous": "speed ladder: friction that does not grow with speed is Coulomb",
        "stribeck": "constant speeds down to 1 mrad/s, both directions",
        "backlash": "vary Kp: level/Kp scales, a gap does not",
        "dead_zone": "vary Kp; a dead zone acts on the command, also while the joint moves",
        "presliding": "amplitude ladder below 1 mrad: presliding is elastic there",
    },
    simulators={
        "mujoco": "joint frictionloss (soft constraint, creeps)",
        "isaac": "dynamicFrictionEffort",
        "gazebo": "<dynamics><friction>",
        "simscape": "Rotational Friction, Coulomb friction torque",
    },
    wrong=CREEP,
    passive=True, symmetry="odd", stiff=True, curve=("dq", 0.01),
)
