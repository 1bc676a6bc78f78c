"""Stribeck friction: dry friction that is larger near rest."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def stribeck_limits(dq: np.ndarray, level: PerJoint, excess: PerJoint, velocity: PerJoint,
                    exponent: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Largest friction torque [N m]: level, and near rest `excess` more."""
    limit = level + excess * np.exp(-np.abs(dq / velocity) ** exponent)
    return limit, limit


VELOCITY = Parameter("velocity", "rad/s", 1e-4, 10.0, 0.02, None,
                     "Stribeck velocity, above which the excess has faded")

STRIBECK = Effect(
    name="stribeck", family="friction", port="load",
    build=dry_friction(stribeck_limits, inputs=("dq",)),
    parameters=(
        Parameter("level", "N m", 0.0, 100.0, 0.05, 0.0, "Coulomb torque of a moving joint"),
        Parameter("excess", "N m", 0.0, 400.0, 0.025, 0.0, "break-away torque beyond it"),
        VELOCITY,
        Parameter("exponent", "1", 0.5, 2.0, 2.0, None, "how sharply the excess fades"),
        WIDTH,
    ),
    equation="tau = (level + excess exp(-|dq/velocity|^exponent)) tanh(dq/width)",
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994",
    signature="Stick-slip on slow ramps, a torque peak at break-away, and friction that falls "
              "with speed below the Stribeck velocity.",
    confused_with={
        "coulomb": "constant speeds spaced in decades below the Stribeck velocity",
        "presliding": "amplitude ladder: presliding returns elastically",
        "rest_time_breakaway": "dwell ladder 1 s to 1000 s: Stribeck does not grow with rest",
        "quadratic_drag": "speeds above the Stribeck velocity: drag keeps growing",
    },
    simulators={
        "mujoco": "actuator dcmotor lugre (Coulomb, static, Stribeck velocity)",
        "isaac": "staticFrictionEffort above dynamicFrictionEffort, no Stribeck velocity",
        "gazebo": "none",
        "simscape": "Rotational Friction, breakaway torque and velocity",
    },
    wrong=CREEP + " The fall with speed is instantaneous; real contacts lag by milliseconds.",
    passive=True, symmetry="odd", stiff=True, curve=("dq", 0.1),
)
