"""Parametric mismatch: the structure of the model is right, its parameters are not.

These four are what a refit of A, B and D takes up; a diagnosis names them apart from effects.
"""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint

_REFERENCE = "paper, eqs. (8)-(10): the coefficients of the decoupled joint"


def extra_inertia(extra: np.ndarray) -> np.ndarray:
    """Inertia matrix [kg m^2] of the error `extra` of each joint's own inertia."""
    return np.eye(extra.shape[0]) * extra


def viscous_torque(dq: np.ndarray, extra: PerJoint) -> np.ndarray:
    """Viscous torque ``extra dq`` [N m] that the model has not."""
    return extra * dq


def gained_torque(u: np.ndarray, error: PerJoint) -> np.ndarray:
    """Motor torque ``(1 + error) u`` [N m]."""
    return u + error * u


def offset_torque(torque: np.ndarray) -> np.ndarray:
    """Constant load torque [N m]."""
    return torque


INERTIA = Effect(
    name="inertia", family="parametric", port="body",
    build=Static(extra_inertia, inputs=(), outputs=("inertia",)),
    parameters=(Parameter("extra", "kg m^2", -100.0, 100.0, 0.1, 0.0,
                          "inertia of the joint less that of the model, motor side"),),
    equation="(inertia + extra) ddq = ...",
    reference=_REFERENCE,
    signature="An error in proportion to the joint's own acceleration.",
    confused_with={
        "torque_gain": "a known mass: a gain changes all torques, gravity too",
        "payload": "hold at several poses: a payload also weighs",
        "actuator_lag": "slow motion at high torque: inertia fades",
    },
    simulators={"mujoco": "joint armature", "isaac": "armature", "gazebo": "<inertia>",
                "simscape": "Inertia"},
    wrong="Constant: it does not change with the pose.",
    passive=True, symmetry="odd",
)

VISCOUS = Effect(
    name="viscous", family="parametric", port="load",
    build=Static(viscous_torque, inputs=("dq",)),
    parameters=(Parameter("extra", "N m s/rad", -100.0, 100.0, 0.2, 0.0,
                          "viscous friction of the joint less that of the model"),),
    equation="tau = extra dq",
    reference=_REFERENCE,
    signature="An error in proportion to the speed; a ramp lags by extra/Kp times its speed.",
    confused_with={
        "coulomb": "speed ladder: friction that grows with speed is viscous",
        "back_emf": "switch the drive off: back-EMF goes, friction stays",
        "gain_error": "two values of Kd: a gain scales with it",
        "quadratic_drag": "speed ladder over a factor of four: only drag is curved",
        "control_law_form": "move the set-point slowly: Kd dq_d follows it, friction the joint",
    },
    simulators={"mujoco": "joint damping", "isaac": "viscousFrictionCoefficient",
                "gazebo": "<dynamics><damping>", "simscape": "Rotational Damper"},
    wrong="Real friction is curved over speed and falls with temperature. A negative value takes "
          "away friction that the plant must have.",
    passive=True, symmetry="odd", curve=("dq", 1.0),
)

TORQUE_GAIN = Effect(
    name="torque_gain", family="parametric", port="drive",
    build=Static(gained_torque, inputs=("u",), outputs=("u",)),
    parameters=(Parameter("error", "1", -0.9, 2.0, 0.1, 0.0,
                          "relative error of the torque per command"),),
    equation="u_motor = (1 + error) u",
    reference=_REFERENCE,
    signature="All torques scaled alike: the same as inertia, friction and load scaled together.",
    confused_with={
        "inertia": "a known mass: a gain changes all torques, gravity too",
        "gain_error": "static known load: the deflection tells Kp from the motor's constant",
        "torque_gain_error": "the same physics; here an unknown B of the model, there a drive "
                             "that departs from a known torque constant",
    },
    simulators={"mujoco": "actuator gear, gainprm", "isaac": "effort scale", "gazebo": "none",
                "simscape": "DC Motor torque constant"},
    wrong="Linear and instantaneous: no saturation, no heating.",
    passive=False, symmetry="odd", curve=("u", 10.0),
)

OFFSET = Effect(
    name="offset", family="parametric", port="load",
    build=Static(offset_torque, inputs=()),
    parameters=(Parameter("torque", "N m", -1e3, 1e3, 0.1, 0.0,
                          "constant load of the joint less that of the model"),),
    equation="tau = torque",
    reference=_REFERENCE,
    signature="A constant error torque/Kp at rest, the same at all poses and speeds.",
    confused_with={
        "gravity": "hold at several poses over more than 1 rad",
        "asymmetric_coulomb": "hold with the drive off: friction has no bias at rest",
        "encoder_offset": "compare poses with an external measurement; vary Kp",
        "step_fault": "compare the start and the end of the record",
    },
    simulators={"mujoco": "actuator biasprm", "isaac": "effort offset", "gazebo": "none",
                "simscape": "Ideal Torque Source"},
    wrong="Constant in time and pose.",
    passive=False, symmetry="even",
)
