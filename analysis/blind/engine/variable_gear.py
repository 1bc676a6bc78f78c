"""Gear whose ratio changes with the angle: the kinematic error of its teeth.

The link follows the motor by ``q = m + a sin(order m + phase)`` (m: the motor's angle over the
ratio).  It is rigid, so the motor is no coordinate of its own: with ``m = g(q)`` its torque acts
on the link as ``g' u``, less the offset of its drive as ``g' offset``, its inertia as ``g'^2 J``
with the torque ``g' g'' J dq^2``, its drag as ``g'^2 D``.
"""

from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot

if TYPE_CHECKING:
    import mujoco

_TURNS = 8  # of Newton's method


class VariableGear:
    """Gears of all lanes, as they change a model of the engine from step to step.

    Parameters
    ----------
    model : mujoco.MjModel
        The engine's.
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.
    motor : ndarray
        Degree of freedom of every joint of every lane.

    """

    def __init__(self, model: "mujoco.MjModel", robot: DrawnRobot, p: Parameters,
                 motor: np.ndarray) -> None:
        self.model, self.p, self.motor, self.shape = model, p, motor, p["wobble"].shape
        lanes, n = self.shape
        self.actuator = np.array([model.actuator(f"u{lane}_{k}").id
                                  for lane in range(lanes) for k in range(n)])
        self.gear = model.actuator_gear[self.actuator, 0].copy()
        self.drag = (p["drag"] * robot.ratio**2).ravel()
        self.bearing = model.dof_damping[motor] - self.drag
        self.rotor = (p["rotor"] * robot.ratio**2).ravel()
        self.link = model.dof_armature[motor] - self.rotor  # what else the engine adds to them

    @property
    def varies(self) -> bool:
        """Whether any gear has an error."""
        return bool(self.p["wobble"].any())

    def turn(self, q: np.ndarray, dq: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Set the gears as they are at an angle; return what opposes the motion [N m, joint].

        The offset of the drives opposes with the stated ratio already.
        """
        first, second = (x.ravel() for x in motor_per_link(q, self.p))
        self.model.actuator_gear[self.actuator, 0] = first * self.gear
        armature = first**2 * self.rotor + self.link
        # of a body alone, centred on its axis, the engine never looks at the armature again
        self.model.dof_M0[self.motor] += armature - self.model.dof_armature[self.motor]
        self.model.dof_armature[self.motor] = armature
        self.model.dof_damping[self.motor] = first**2 * self.drag + self.bearing
        turning = (first * second * self.rotor * dq.ravel()**2).reshape(self.shape)
        return turning + (first.reshape(self.shape) - 1.0) * offset


def rigid_motor(q: np.ndarray, p: Parameters) -> np.ndarray:
    """Angle of each motor over its stated ratio, where its link is at q and its gear is stiff.

    The link may wobble, travel further than stated, or be dragged along by the joint before.
    """
    before = np.concatenate([np.zeros_like(q[:, :1]), q[:, :-1]], axis=1)
    return _motor(q - p["travel_of_neighbour"] * before, p) / (1.0 + p["ratio_error"])


def motor_per_link(q: np.ndarray, p: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative of the motor's angle over the ratio by the link's angle."""
    a, order, phase, m = p["wobble"], p["wobble_order"], p["phase"], _motor(q, p)
    slope = 1 / (1 + a * order * np.cos(order * m + phase))
    return slope, a * order**2 * np.sin(order * m + phase) * slope**3


def _motor(q: np.ndarray, p: Parameters) -> np.ndarray:
    """Angle of each motor over the ratio at an angle of its wobbling link."""
    a, order, phase, m = p["wobble"], p["wobble_order"], p["phase"], q
    for _ in range(_TURNS):
        m = m - (m + a * np.sin(order * m + phase) - q) / (1 + a * order * np.cos(
            order * m + phase))
    return m
