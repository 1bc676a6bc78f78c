"""Something that breaks, jams or is put on at one moment."""

import numpy as np

from clie_blocks.effects.chain import GEAR_RATIO
from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.gravity import gravity_torque
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import WIDTH
from clie_blocks.labels import PerJoint


def step_fault_limits(t: float, q: np.ndarray, dq: np.ndarray, u: np.ndarray, coulomb: PerJoint,
                      time: PerJoint) -> tuple[np.ndarray, np.ndarray]:
    """Largest dry friction that is there from `time` on [N m]."""
    limit = _since(t, time) * coulomb
    return limit, limit


def step_fault_torque(t: float, q: np.ndarray, dq: np.ndarray, u: np.ndarray, offset: PerJoint,
                      weight: PerJoint, viscous: PerJoint, gain_loss: PerJoint, time: PerJoint,
                      gear_ratio: PerJoint) -> np.ndarray:
    """Torque that is there from `time` on [N m]: load, weight, drag or lost drive torque."""
    return _since(t, time) * (offset + gravity_torque(q, weight, gear_ratio) + viscous * dq
                              + gain_loss * u)


def _since(t: float, time: PerJoint) -> np.ndarray:
    return np.where(t >= time, 1.0, 0.0)


STEP_FAULT = Effect(
    name="step_fault", family="environment", port="environment",
    build=dry_friction(step_fault_limits, inputs=("t", "q", "dq", "u"), rest=step_fault_torque),
    parameters=(
        Parameter("offset", "N m", -1e3, 1e3, 0.1, 0.0, "constant torque"),
        Parameter("weight", "N m", -1e3, 1e3, 0.0, 0.0,
                  "moment of a weight put on, as in gravity: at the tip, m g times each length"),
        Parameter("viscous", "N m s/rad", -100.0, 100.0, 0.0, 0.0, "viscous friction"),
        Parameter("coulomb", "N m", 0.0, 100.0, 0.0, 0.0, "Coulomb friction"),
        Parameter("gain_loss", "1", -1.0, 1.0, 0.0, 0.0, "share of the drive's torque lost"),
        Parameter("time", "s", 0.0, 1e6, 5.0, None, "when it happens"),
        GEAR_RATIO, WIDTH,
    ),
    equation="tau = (t >= time) (offset + gravity(q, weight) + viscous dq + "
             "coulomb tanh(dq/width) + gain_loss u)",
    reference="R. Isermann, Fault-Diagnosis Systems, Springer 2006 (abrupt faults)",
    signature="Two records in one: a good model before a moment, a biased one after.",
    confused_with={
        "friction_drift": "repeat the same motion every minute: a drift is gradual",
        "gravity": "return to the first pose: gravity comes back to its first value",
        "packet_hold": "time stamps: a held packet ends after milliseconds",
        "offset": "compare the start and the end of the record",
    },
    simulators={
        "mujoco": "model field changed by the user",
        "isaac": "property changed by the user",
        "gazebo": "plugin",
        "simscape": "Step",
    },
    wrong="One step that stays. A payload put on at that moment also adds inertia, which is left "
          "out.",
    passive=False, symmetry="none", per_joint=False, curve=("t", 10.0),
)
