"""Dry friction that changes with the position: bent shafts, worn teeth, tight bearings."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def position_dependent_limits(q: np.ndarray, dq: np.ndarray, level: PerJoint, sine: PerJoint,
                              cosine: PerJoint, order: PerJoint,
                              ) -> tuple[np.ndarray, np.ndarray]:
    """Largest friction torque [N m]: ``level + sine sin(order q) + cosine cos(order q)``."""
    limit = np.maximum(level + sine * np.sin(order * q) + cosine * np.cos(order * q), 0.0)
    return limit, limit


POSITION_DEPENDENT_FRICTION = Effect(
    name="position_dependent_friction", family="friction", port="load",
    build=dry_friction(position_dependent_limits, inputs=("q", "dq")),
    parameters=(
        Parameter("level", "N m", 0.0, 100.0, 0.05, 0.0, "mean friction torque"),
        Parameter("sine", "N m", -100.0, 100.0, 0.01, 0.0, "amplitude of the sine"),
        Parameter("cosine", "N m", -100.0, 100.0, 0.0, 0.0, "amplitude of the cosine"),
        Parameter("order", "1", 0.1, 1e4, 8.0, None, "periods per turn of the joint"),
        WIDTH,
    ),
    equation="tau = max(level + sine sin(order q) + cosine cos(order q), 0) tanh(dq / width)",
    reference="B. Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991",
    signature="A friction that repeats with the position and changes sign with the direction.",
    confused_with={
        "torque_ripple": "same path both ways: ripple keeps its sign, friction turns",
        "coulomb": "slow sweep of the full range: Coulomb is flat in position",
        "gravity": "same path both ways: half the difference is friction, the mean gravity",
        "load_dependent_friction": "same path with another payload",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="One sine; measured maps have several. " + CREEP,
    passive=True, symmetry="none", stiff=True, curve=("q", 3.2),
)
