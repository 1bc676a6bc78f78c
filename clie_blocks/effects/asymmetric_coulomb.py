"""Coulomb friction that differs with the direction of motion."""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import CREEP, WIDTH
from clie_blocks.labels import PerJoint


def asymmetric_coulomb_limits(dq: np.ndarray, forward: PerJoint,
                              backward: PerJoint) -> tuple[PerJoint, PerJoint]:
    """Friction torque [N m]: `forward` for dq > 0, `backward` for dq < 0, against the motion."""
    return forward, backward


ASYMMETRIC_COULOMB = Effect(
    name="asymmetric_coulomb", family="friction", port="load",
    build=dry_friction(asymmetric_coulomb_limits, inputs=("dq",)),
    parameters=(
        Parameter("forward", "N m", 0.0, 100.0, 0.07, 0.0, "friction torque for dq > 0"),
        Parameter("backward", "N m", 0.0, 100.0, 0.04, 0.0, "friction torque for dq < 0"),
        WIDTH,
    ),
    equation="tau = (forward if dq > 0 else backward) tanh(dq / width)",
    reference="A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019 "
              "(17.05 N and 23.41 N)",
    signature="A step at each reversal and a constant bias; holding torque depends on the last "
              "direction.",
    confused_with={
        "coulomb": "compare the torque at equal speeds in both directions",
        "offset": "exactly coulomb plus offset while it moves; an independent torque reference "
                  "or a hold with the drive off separates them",
        "gravity": "several poses: the bias of friction does not depend on the pose",
    },
    simulators={
        "mujoco": "joint frictionloss with a constant actuator bias (biasprm)",
        "isaac": "friction with an effort offset",
        "gazebo": "none",
        "simscape": "none",
    },
    wrong=CREEP + " Coulomb friction plus an offset is the same while the joint moves.",
    passive=True, symmetry="none", stiff=True, curve=("dq", 0.01),
)
