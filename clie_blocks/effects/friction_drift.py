"""Friction that drifts as the joint warms up."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import WIDTH
from clie_blocks.labels import PerJoint


def warm_up(t: float, since: PerJoint, time_constant: PerJoint) -> np.ndarray:
    """How warm the joint is: 0 at rest for long, 1 when all is warm."""
    return 1.0 - np.exp(-(t + since) / time_constant)


def drifting_limits(t: float, dq: np.ndarray, level: PerJoint, coulomb_change: PerJoint,
                    time_constant: PerJoint, since: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Largest friction torque [N m]: `level` when cold, and its change as the joint warms up."""
    limit = level + coulomb_change * warm_up(t, since, time_constant)
    return limit, limit


def drifting_drag(t: float, dq: np.ndarray, viscous_change: PerJoint, time_constant: PerJoint,
                  since: PerJoint) -> np.ndarray:
    """Change of the viscous friction torque [N m] as the joint warms up."""
    return viscous_change * dq * warm_up(t, since, time_constant)


FRICTION_DRIFT = Effect(
    name="friction_drift", family="friction", port="load",
    build=dry_friction(drifting_limits, inputs=("t", "dq"), rest=drifting_drag),
    parameters=(
        Parameter("viscous_change", "N m s/rad", -100.0, 100.0, -0.2, 0.0,
                  "viscous friction when warm, less that at the start"),
        Parameter("coulomb_change", "N m", -100.0, 100.0, 0.0, 0.0,
                  "Coulomb torque when warm, less that at the start"),
        Parameter("level", "N m", 0.0, 100.0, 0.0, 0.0, "Coulomb torque at the start"),
        Parameter("time_constant", "s", 0.1, 1e5, 20.0, None, "time constant of the warm-up"),
        Parameter("since", "s", 0.0, 1e6, 0.0, None, "how long it had moved at t = 0"),
        WIDTH,
    ),
    equation="tau = level tanh(dq/width) + (1 - exp(-(t + since)/time_constant)) "
             "(viscous_change dq + coulomb_change tanh(dq/width))",
    reference="A. C. Bittencourt, S. Gunnarsson, Static Friction in a Robot Joint: Modeling and "
              "Identification of Load and Temperature Effects, ASME J. DSMC 134(5), 2012",
    signature="The same motion needs another torque minutes later; torque at standstill keeps.",
    confused_with={
        "viscous": "repeat the first motion at the end of the record",
        "motor_heating": "static hold before and after: heating changes the gain, not friction",
        "supply_sag": "move one joint, then all: sag follows the total current at once",
        "step_fault": "repeat the same motion every minute: a drift is gradual",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="Warm-up follows the clock from t = 0 of the run; a real joint warms with the energy "
          "it loses, and cools at rest. A negative change takes away friction that the plant "
          "must have, so that alone it is not passive.",
    passive=False, symmetry="odd", curve=("t", 60.0),
)
