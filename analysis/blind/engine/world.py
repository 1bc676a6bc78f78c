"""Robots as MuJoCo bodies; several share one world as lanes and never touch.

What the engine has of its own is used: dry friction, damping, springs, limits, contact, tilted
mounts, delay, lag and limit of a drive, cogging and bristles of its motor.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.blind.engine.robot import LINKS_UNSTATED, DrawnRobot, G
from clie_blocks.errors import MissingExtraError

if TYPE_CHECKING:
    import mujoco

STEP, COARSE = 5e-4, 1e-3  # s, of the engine: where something is stiff, and elsewhere
DRY_FRICTION = ("level", "slope", "wavy_level", "warm_level", "fault_level")
_STIFF = (*DRY_FRICTION, "bristle", "twist_stiffness", "half_gap", "lag", "delay", "late", "wall")
_SPECK = 1e-6  # kg, kg m^2: the engine refuses bodies without mass
_DRY = 'frictionloss="1e-9" solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
_SOLID = 'solreflimit="0.004 1" solimplimit="0.99 0.99 0.001 0.5 2"'
_XML = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step}" gravity="0 0 {down}" integrator="RK4">
    <flag autoreset="disable"/>
  </option>
  <worldbody>{bodies}</worldbody>
  <contact>{contacts}</contact>
  <actuator>{motors}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>"""
_OHM = 1e-9  # of a heated motor: small, so that its speed does not brake it
_EXPANSION = 4e-3  # 1/K, of the resistance of copper


def engine_step(robot: DrawnRobot, lanes: Sequence[dict[str, np.ndarray]]) -> float:
    """Step of the engine [s]: fine where a lane has something stiff."""
    stiff = any(np.any(lane[key] > 0) for lane in lanes for key in _STIFF)
    stiff = stiff or any(np.isfinite(lane["hard_stop"]).any() for lane in lanes)
    return STEP if stiff else min(COARSE, robot.period)


def build_model(robot: DrawnRobot, lanes: Sequence[dict[str, np.ndarray]]) -> "mujoco.MjModel":
    """Return a MuJoCo model that holds one copy of a robot per lane.

    Joints are called ``a{lane}_{k}``, twists behind the motor ``b{lane}_{k}``, delayed encoders
    ``s{lane}_{k}``.

    Parameters
    ----------
    robot : DrawnRobot
        The robot.
    lanes : list of dict
        True parameters of each copy, see `healthy_parameters`.

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
    bodies = [(_axes_bodies if robot.kind == "axes" or not lane["links"].any() else _chain_bodies)(
        robot, lane, j) for j, lane in enumerate(lanes)]
    return mujoco.MjModel.from_xml_string(_XML.format(
        step=engine_step(robot, lanes), down=-G,
        bodies="".join(bodies + [_wall(robot, lanes[j], j) for j in walled]),
        contacts="".join(f'<pair geom1="tip{j}" geom2="wall{j}" solref="0.02 1"/>'
                         for j in walled),
        motors="".join(_motor(robot, lane, j, k) + _passive(robot, lane, j, k)
                       for j, lane in enumerate(lanes) for k in range(robot.n)),
        sensors="".join(_delayed_encoder(lane["late"][k], j, k) for j, lane in enumerate(lanes)
                        for k in range(robot.n) if lane["late"][k] > 0)))


def _chain_bodies(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int) -> str:
    """Links in series; what is missing of their inertia turns with the rotors."""
    share = p["links"][0]
    counted = 1.0 if robot.kind in LINKS_UNSTATED else 0.0  # share of the links in the rotors
    p = {**p, "rotor": p["rotor"] + (1 - share - counted) * robot.link / robot.ratio**2}
    inside, weightless = _tip(robot, p, lane), _weightless(robot, p)
    for k in reversed(range(robot.n)):
        tip = _mass(p["payload"][k], robot.length[k], weightless)
        inertial = _inertial(share * robot.mass[k], share * robot.inertia[k], robot.com[k])
        at = robot.length[k - 1] if k else 0.0
        inside = _joint_body(robot, p, lane, k, at, inertial + tip + inside, weightless)
    return inside


def _axes_bodies(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int) -> str:
    """Independent joints, each with the inertia of its links at the pose."""
    if robot.kind == "axes":  # the datasheet counts the links to the rotors
        p = {**p, "rotor": p["rotor"] - robot.link / robot.ratio**2}
    return "".join(_joint_body(robot, p, lane, k, 0.0, _inertial(_SPECK, robot.link[k], 0.0), 1.0)
                   for k in range(robot.n))


def _joint_body(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int, k: int, at: float,
                link: str, weightless: float) -> str:
    """Body behind a gear; positive angles lift a link along x out of the horizontal."""
    r2 = robot.ratio[k] ** 2
    drag, quadratic = p["drag"][k] * r2, p["quadratic"][k] * robot.ratio[k]
    dry = _DRY if any(p[key][k] > 0 for key in DRY_FRICTION) else ""
    stop = p["hard_stop"][k]
    if np.isfinite(stop):
        dry += f' range="{stop - 10} {stop}" {_SOLID}'
    axis = "0 0 1" if robot.kind == "spatial" and k == 0 else "0 -1 0"
    hinge = (f'<joint name="a{lane}_{k}" type="hinge" axis="{axis}" '
             f'armature="{p["rotor"][k] * r2}" {dry} stiffness="{p["stiffness"][k]}" '
             f'springref="{p["rest"][k]}" damping="{drag + robot.bearing[k]} {quadratic} 0"/>')
    twist = _twist(p, lane, k, axis)
    if not twist:
        return f'<body pos="{at} 0 0" gravcomp="{weightless}">{hinge}{link}</body>'
    return (f'<body pos="{at} 0 0" gravcomp="1">{_inertial(_SPECK, _SPECK, 0.0)}{hinge}'
            f'<body gravcomp="{weightless}">{twist}{link}</body></body>')


def _twist(p: dict[str, np.ndarray], lane: int, k: int, axis: str) -> str:
    """Second hinge behind the motor: a spring, or a gap between stiff flanks."""
    name = f'<joint name="b{lane}_{k}" type="hinge" axis="{axis}"'
    if p["half_gap"][k] > 0:
        return f'{name} range="{-p["half_gap"][k]} {p["half_gap"][k]}" {_SOLID}/>'
    if p["twist_stiffness"][k] > 0:
        return (f'{name} stiffness="{p["twist_stiffness"][k]}" '
                f'damping="{p["twist_damping"][k]}"/>')
    return ""


def _delayed_encoder(delay: float, lane: int, k: int) -> str:
    """Angle some time ago [s]; the engine reads its sensors at the beginning of a step."""
    delay = max(delay - STEP, 1e-9)
    return (f'<jointpos name="s{lane}_{k}" joint="a{lane}_{k}" delay="{delay}" '
            f'nsample="{int(delay / STEP) + 4}" interp="linear"/>')


def _motor(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int, k: int) -> str:
    limit = p["limit"][k]
    if p["heating"][k] > 0:
        resistance = p["heating"][k] * _OHM / _EXPANSION  # K/W
        return (f'<dcmotor joint="a{lane}_{k}" gear="{robot.ratio[k]}" motorconst="{_OHM} {_OHM}" '
                f'resistance="{_OHM}" thermal="{resistance} 0 {p["heating_time"][k]} '
                f'{_EXPANSION} 20 20"/>')
    parts = [f'joint="a{lane}_{k}" gear="{robot.ratio[k] * p["gain"][k]}"']
    if np.isfinite(limit):
        parts.append(f'forcerange="{-limit} {limit}"')
    if p["lag"][k] > STEP / 2:  # the engine cannot follow what is faster, nor would it show
        parts.append(f'dyntype="filter" dynprm="{p["lag"][k]}"')
    if p["delay"][k] > 0:
        parts.append(f'delay="{p["delay"][k]}" nsample="{int(p["delay"][k] / STEP) + 4}" '
                     'interp="linear"')
    return f'<general {" ".join(parts)}/>'


def _passive(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int, k: int) -> str:
    """Cogging and bristles, as a motor without input."""
    parts, ratio = [], robot.ratio[k]
    if p["ripple"][k] > 0:
        parts.append(f'cogging="{p["ripple"][k]} {round(p["poles"][k])} {p["phase"][k]}"')
    if p["bristle"][k] > 0:
        level = p["bristle"][k]
        stiffness = level / (p["bristle_range"][k] * ratio)
        parts.append(f'lugre="{stiffness} 0 {level} {level} 1"')
    if not parts:
        return ""
    return (f'<dcmotor joint="a{lane}_{k}" gear="{ratio}" input="none" motorconst="0 0" '
            f'resistance="1" {" ".join(parts)}/>')


def _weightless(robot: DrawnRobot, p: dict[str, np.ndarray]) -> float:
    """Share of its weight that the mounting takes: all of it when level, less when tilted."""
    return 0.0 if robot.gravity else 1.0 - np.sin(p["tilt"][0])


def _tip(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int) -> str:
    if not p["wall"].any():
        return ""
    return (f'<geom name="tip{lane}" type="sphere" size="0.0001" pos="{robot.length[-1]} 0 0" '
            'mass="0" contype="0" conaffinity="0"/>')


def _wall(robot: DrawnRobot, p: dict[str, np.ndarray], lane: int) -> str:
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


def _mass(mass: float, at: float, weightless: float) -> str:
    if mass <= 0:
        return ""
    return (f'<body pos="{at} 0 0" gravcomp="{weightless}">{_inertial(mass, 1e-9, 0.0)}'
            '</body>')


def _inertial(mass: float, inertia: float, com: float) -> str:
    return (f'<inertial pos="{com} 0 0" mass="{mass}" '
            f'diaginertia="{inertia} {inertia} {inertia}"/>')
