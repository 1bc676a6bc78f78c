"""Inertial coupling between neighbouring links, which decoupled joints leave out."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.chain import GEAR_RATIO, absolute, onto_joints
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def coupling_terms(q: np.ndarray, dq: np.ndarray, moment: PerJoint, turning: np.ndarray,
                   gear_ratio: PerJoint = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Inertia [kg m^2] and Coriolis torque [N m] that couple links, motor side.

    From the energy ``sum_k moment_k cos(q_k) w_(k-1) w_k + turning_k w_k^2 / 2`` with the absolute
    rates w, less the part of `turning` that each joint feels alone: that is in its own inertia.
    """
    n = q.shape[-1]
    before = np.eye(n, k=1)  # x @ before moves each entry to the next joint
    chain, alone = np.tril(np.ones((n, n))), np.eye(n)
    pair = (moment * np.cos(q))[..., :, None] * before.T
    shared = (1.0 - alone) * (chain.T @ (turning[:, None] * chain))
    inertia = chain.T @ (pair + np.swapaxes(pair, -1, -2)) @ chain + shared
    lever, square = moment * np.sin(q), absolute(dq) ** 2
    torque = onto_joints(lever * (square @ before) - (lever * square) @ before.T)
    ratio = gear_ratio * np.ones(n)
    return inertia / ratio[:, None], torque / ratio


COUPLING = Effect(
    name="coupling", family="load", port="body",
    build=Static(coupling_terms, inputs=("q", "dq"), outputs=("inertia", "tau")),
    parameters=(
        Parameter("moment", "kg m^2", -10.0, 10.0, 0.05, 0.0,
                  "m l c of a link: its mass, the length of the link before, the distance of "
                  "its centre of mass; that of the first joint does nothing"),
        Parameter("turning", "kg m^2", 0.0, 10.0, 0.0, 0.0,
                  "inertia of a link and all beyond about its joint, as the joints before feel "
                  "it; that of the first joint does nothing"),
        GEAR_RATIO,
    ),
    equation="r_k tau_k from T = sum over k of moment_k cos(q_k) w_(k-1) w_k + turning_k w_k^2/2, "
             "w_k = dq_0 + ... + dq_k",
    reference="paper, section 5, matrices M and C; M. W. Spong, S. Hutchinson, M. Vidyasagar, "
              "Robot Modeling and Control, chapter 7",
    signature="An error only while other joints move, with their acceleration and the square of "
              "their speed.",
    confused_with={
        "coupled_joints": "slow motion: inertia fades, a gear that couples does not",
        "payload": "move one joint alone: a payload still acts",
        "periodic_disturbance": "stop the other joints: a disturbance goes on",
        "inertia": "stop the other joints and change the pose",
    },
    simulators={
        "mujoco": "always there (full multibody dynamics)",
        "isaac": "always there",
        "gazebo": "always there",
        "simscape": "always there (Multibody)",
    },
    wrong="Exact for a planar arm of two links; of three and more, only neighbours are coupled. "
          "A moment too large for the plant's inertia makes "
          "the sum indefinite.",
    passive=True, symmetry="odd", per_joint=False, side="link",
)
