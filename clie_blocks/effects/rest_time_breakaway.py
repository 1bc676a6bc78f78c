"""Break-away torque that grows while the joint rests."""

import numpy as np

from clie_blocks.effects.dry_friction import ageing_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import WIDTH
from clie_blocks.labels import PerJoint


def nearness_to_rest(dq: np.ndarray, velocity: PerJoint) -> np.ndarray:
    """How much of a rest the motion is: 1 at standstill, 0 above the Stribeck velocity."""
    return np.exp(-(dq / velocity) ** 2)


def contact_age_rate(age: np.ndarray, dq: np.ndarray, velocity: PerJoint,
                     slip: PerJoint) -> np.ndarray:
    """Rate of the contact's age [s/s]: it grows at rest and is renewed by sliding over `slip`."""
    return nearness_to_rest(dq, velocity) - age * np.abs(dq) / slip


def contact_age_step(age: np.ndarray, dq: np.ndarray, velocity: PerJoint, slip: PerJoint,
                     period: float) -> np.ndarray:
    """Age of the contact after a period at one velocity [s], exact."""
    renewed = np.abs(dq) / slip * period
    share = np.where(renewed > 1e-8, -np.expm1(-renewed) / np.maximum(renewed, 1e-8), 1.0)
    return age * np.exp(-renewed) + nearness_to_rest(dq, velocity) * period * share


def rest_time_limits(age: np.ndarray, dq: np.ndarray, rise: PerJoint, half_time: PerJoint,
                     velocity: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Excess of the break-away torque after a rest [N m], half of `rise` after `half_time`."""
    limit = rise * age / (age + half_time) * nearness_to_rest(dq, velocity)
    return limit, limit


REST_TIME_BREAKAWAY = Effect(
    name="rest_time_breakaway", family="friction", port="load",
    build=ageing_friction(rest_time_limits, contact_age_rate, contact_age_step, inputs=("dq",),
                          state="age"),
    parameters=(
        Parameter("rise", "N m", 0.0, 100.0, 0.1, 0.0, "excess of break-away after a long rest"),
        Parameter("half_time", "s", 0.01, 1e4, 5.0, None, "rest that gives half the excess"),
        Parameter("velocity", "rad/s", 1e-4, 10.0, 0.02, None, "speed that still counts as rest"),
        Parameter("slip", "rad", 1e-4, 1.0, 0.02, None, "sliding distance that renews it"),
        WIDTH,
    ),
    equation="age' = r - age |dq|/slip, tau = rise age/(age + half_time) r tanh(dq/width), "
             "r = exp(-(dq/velocity)^2)",
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30(7), 1994; "
              "rest term as in J. R. Rice, A. L. Ruina, J. Appl. Mech. 50, 1983",
    signature="The first move after a rest needs more torque, the more the longer the rest.",
    confused_with={
        "stribeck": "dwell ladder 1 s to 1000 s: Stribeck does not grow with rest",
        "friction_drift": "several moves after one rest: only the first is heavy",
        "presliding": "amplitude ladder: presliding is elastic, not heavy",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="The run starts with a fresh contact (age 0), whatever the rest before it. Smoothed, "
          "it creeps at up to about width while it rests.",
    passive=True, symmetry="odd", stiff=True,
)
