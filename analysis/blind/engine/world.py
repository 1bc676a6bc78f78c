"""Robots as MuJoCo bodies; several share one world as lanes and never touch.

What the engine has of its own is used: dry friction, damping, springs, limits, contact, tilted
mounts, tendons, delay, lag and limit of a drive, cogging and bristles of its motor.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.blind.engine.actuators import (
    COARSE,
    STEP,
    delayed_encoder,
    motor,
    passive,
    tendons,
)
from clie_blocks.analysis.blind.engine.bodies import robot_bodies
from clie_blocks.analysis.blind.engine.parameters import DRY_FRICTION, G, Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.errors import MissingExtraError

if TYPE_CHECKING:
    import mujoco

_STIFF = (*DRY_FRICTION, "bristle", "twist_stiffness", "half_gap", "lag", "delay", "late", "wall",
          "dahl", "slip", "wobble", "mesh", "phase_gain", "jitter", "detent", "link_stiffness",
          "mount_stiffness", "travel_of_neighbour")
_XML = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step}" gravity="0 0 {down}" integrator="RK4">
    <flag autoreset="disable"/>
  </option>
  <worldbody>{bodies}</worldbody>
  <contact>{contacts}</contact>
  <tendon>{tendons}</tendon>
  <actuator>{motors}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>"""


def engine_step(robot: DrawnRobot, lanes: Sequence[Parameters]) -> float:
    """Step of the engine [s]: fine where a lane has something stiff."""
    stiff = any(np.any(lane[key] > 0) for lane in lanes for key in _STIFF)
    stiff = stiff or any(np.isfinite(lane["hard_stop"]).any() for lane in lanes)
    return STEP if stiff else min(COARSE, robot.period)


def build_model(robot: DrawnRobot, lanes: Sequence[Parameters]) -> "mujoco.MjModel":
    """Return a MuJoCo model that holds one copy of a robot per lane.

    Joints are called ``a{lane}_{k}``, twists behind the motor ``b{lane}_{k}``, delayed encoders
    ``s{lane}_{k}``; a pendulum at a tip ``p``, the bends of a link ``f`` and ``g``, a soft mount
    ``m``.

    Parameters
    ----------
    robot : DrawnRobot
        The robot.
    lanes : list of dict
        True parameters of each copy, see `parameters.healthy_parameters`.

    Raises
    ------
    MissingExtraError
        Without MuJoCo.

    """
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("making blind trials", "MuJoCo", "mujoco") from None
    walled = [j for j, lane in enumerate(lanes) if lane["wall"].any()]
    joints = [(lane, j, k) for j, lane in enumerate(lanes) for k in range(robot.n)]
    return mujoco.MjModel.from_xml_string(_XML.format(
        step=engine_step(robot, lanes), down=-G,
        bodies="".join([robot_bodies(robot, lane, j) for j, lane in enumerate(lanes)]
                       + [_wall(robot, lanes[j], j) for j in walled]),
        contacts="".join(f'<pair geom1="tip{j}" geom2="wall{j}" solref="0.02 1"/>'
                         for j in walled),
        tendons="".join(tendons(robot, lane, j, k) for lane, j, k in joints),
        motors="".join(motor(robot, lane, j, k) + passive(robot, lane, j, k)
                       for lane, j, k in joints),
        sensors="".join(delayed_encoder(lane["late"][k], j, k) for lane, j, k in joints
                        if lane["late"][k] > 0)))


def _wall(robot: DrawnRobot, p: Parameters, lane: int) -> str:
    """Plane across the path of the tip, at the distance ``wall`` along it."""
    at, along = tip_path(robot)
    x, z = at + p["wall"].max() * along
    return (f'<geom name="wall{lane}" type="plane" size="1 1 1" pos="{x} 0 {z}" '
            f'zaxis="{-along[0]} 0 {-along[1]}" contype="0" conaffinity="0"/>')


def tip_path(robot: DrawnRobot) -> tuple[np.ndarray, np.ndarray]:
    """Tip at the pose, and the direction in which the first joint moves it, each (x, z) [m]."""
    angle = np.cumsum(robot.pose)
    at = np.array([robot.length @ np.cos(angle), robot.length @ np.sin(angle)])
    return at, np.array([-at[1], at[0]]) / np.hypot(*at)
