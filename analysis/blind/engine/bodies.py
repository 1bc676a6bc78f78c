"""Links, gears and what they carry, as text for MuJoCo; positive angles lift a link."""

import numpy as np

from clie_blocks.analysis.blind.engine.actuators import (
    ANCHOR,
    LEVER,
    true_ratio,
)
from clie_blocks.analysis.blind.engine.parameters import DRY_FRICTION, G, Parameters
from clie_blocks.analysis.blind.engine.robot import LINKS_UNSTATED, DrawnRobot
from clie_blocks.analysis.blind.engine.spatial_links import SpatialLinks

_SPECK = 1e-10  # kg, kg m^2: the engine refuses bodies without mass, a wrist has 1e-5
_DRY = 'frictionloss="1e-9" solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
SOLID = 'solreflimit="0.004 1" solimplimit="0.99 0.99 0.001 0.5 2"'
_SWING = 0.05  # share of critical damping of a pendulum at the tip
_RING = 0.02  # the same of a link that bends
_MOUNT = 0.1  # the same of a soft mount
_SPREAD = 0.8  # share of a bending link's inertia that its three lumps have by their distance


def robot_bodies(robot: DrawnRobot, p: Parameters, lane: int) -> str:
    """Bodies of one copy of a robot."""
    if robot.links is not None:
        return _spatial_bodies(robot, robot.links, p, lane)
    side_by_side = robot.kind == "axes" or not p["links"].any()
    return (_axes_bodies if side_by_side else _chain_bodies)(robot, p, lane)


def _chain_bodies(robot: DrawnRobot, p: Parameters, lane: int) -> str:
    """Links in series; what is missing of their inertia turns with the rotors."""
    share = p["links"][0]
    counted = 1.0 if robot.kind in LINKS_UNSTATED else 0.0  # share of the links in the rotors
    p = {**p, "rotor": p["rotor"] + (1 - share - counted) * robot.link / robot.ratio**2}
    inside, weightless = _tip(robot, p, lane), _weightless(robot, p)
    for k in reversed(range(robot.n)):
        tip = _mass(p["payload"][k], np.array([robot.length[k], 0.0, 0.0]), weightless)
        inertial = _inertial(share * robot.mass[k], share * robot.inertia[k], robot.com[k])
        if p["link_stiffness"][k] > 0:
            inertial = _bending_link(robot, p, lane, k, weightless)
        tip += _pendulum(robot, p, lane, k)
        at = np.array([robot.length[k - 1] if k else 0.0, 0.0, 0.0])
        inside = _joint_body(robot, p, lane, k, at, inertial + tip + inside, weightless)
    return _mounted(robot, p, lane, inside)


def _axes_bodies(robot: DrawnRobot, p: Parameters, lane: int) -> str:
    """Independent joints, each with the inertia of its links at the pose."""
    if robot.kind == "axes":  # the datasheet counts the links to the rotors
        p = {**p, "rotor": p["rotor"] - robot.link / robot.ratio**2}
    return "".join(_joint_body(robot, p, lane, k, np.zeros(3),
                               _inertial(_SPECK, robot.link[k], 0.0), 1.0)
                   for k in range(robot.n))


def _spatial_bodies(robot: DrawnRobot, links: SpatialLinks, p: Parameters, lane: int) -> str:
    """Links of an arm in space, with a payload at the tool."""
    inside = ""
    for k in reversed(range(robot.n)):
        share = 1.0 + p["heavier"][k]
        mass, spread = share * links.mass[k], share * links.inertia[k]
        inertial = (f'<inertial pos="{_triple(links.com[k])}" mass="{mass}" '
                    f'diaginertia="{_triple(spread)}"/>')
        inertial += _mass(p["payload"][k], links.end[k], 0.0)
        inside = _joint_body(robot, p, lane, k, links.at(k), inertial + inside, 0.0)
    return inside


def _joint_body(robot: DrawnRobot, p: Parameters, lane: int, k: int, at: np.ndarray,
                link: str, weightless: float) -> str:
    """Body behind a gear; positive angles lift a link along x out of the horizontal."""
    r2 = true_ratio(robot, p, k) ** 2
    rotor, drag = p["rotor"][k] * r2, p["drag"][k] * r2
    if p["travel_of_neighbour"][k]:  # then they turn at the end of a tendon
        rotor = drag = 0.0
    quadratic = p["quadratic"][k] * robot.ratio[k]
    dry = _DRY if any(p[key][k] > 0 for key in DRY_FRICTION) else ""
    stop = p["hard_stop"][k]
    if np.isfinite(stop):
        dry += f' range="{stop - 10} {stop}" {SOLID}'
    axis = _axis(robot, k)
    hinge = (f'<joint name="a{lane}_{k}" type="hinge" axis="{axis}" '
             f'armature="{rotor}" {dry} stiffness="{p["stiffness"][k]}" '
             f'springref="{p["rest"][k]}" damping="{drag + robot.bearing[k]} {quadratic} 0"/>')
    anchor, lever = _counterbalance_sites(p, lane, k, at)
    turned = f' euler="0 {-p["base_tilt"][0]} 0"' if k == 0 and p["base_tilt"].any() else ""
    twist = _twist(p, lane, k, axis)
    if not twist:
        return (f'{anchor}<body pos="{_triple(at)}"{turned} gravcomp="{weightless}">{hinge}{lever}'
                f'{link}</body>')
    return (f'{anchor}<body pos="{_triple(at)}"{turned} gravcomp="1">'
            f'{_inertial(_SPECK, _SPECK, 0.0)}{hinge}'
            f'<body gravcomp="{weightless}">{twist}{lever}{link}</body></body>')


def _axis(robot: DrawnRobot, k: int) -> str:
    if robot.links is not None:
        return _triple(robot.links.axis[k])
    return "0 0 1" if robot.kind == "spatial" and k == 0 else "0 -1 0"


def _twist(p: Parameters, lane: int, k: int, axis: str) -> str:
    """Second hinge behind the motor: a spring, or a gap between stiff flanks.

    A gear that stiffens is twice as stiff against small changes once twisted by a little more
    than half its knee: its torque is ``K x (1 + (x / knee)^2)``.
    """
    name = f'<joint name="b{lane}_{k}" type="hinge" axis="{axis}"'
    if p["half_gap"][k] > 0:
        return f'{name} range="{-p["half_gap"][k]} {p["half_gap"][k]}" {SOLID}/>'
    if p["twist_stiffness"][k] > 0:
        stiffness = p["twist_stiffness"][k]
        cubic = stiffness / p["twist_knee"][k] ** 2
        return (f'{name} stiffness="{stiffness}{f" 0 {cubic}" if cubic else ""}" '
                f'damping="{p["twist_damping"][k]}"/>')
    return ""


def _counterbalance_sites(p: Parameters, lane: int, k: int, at: np.ndarray) -> tuple[str, str]:
    """Where a counterbalance spring holds on: to the link before the joint, and behind it."""
    if not p["balance"][k]:
        return "", ""
    angle = p["balance_angle"][k]
    x, z = at[0] + ANCHOR * np.cos(angle), ANCHOR * np.sin(angle)
    return (f'<site name="anchor{lane}_{k}" pos="{x} 0 {z}"/>',
            f'<site name="lever{lane}_{k}" pos="{LEVER} 0 0"/>')


def _pendulum(robot: DrawnRobot, p: Parameters, lane: int, k: int) -> str:
    """Mass that swings freely at the end of a link, as a liquid does in its vessel."""
    mass, length = p["slosh"][k], p["slosh_length"][k]
    if mass <= 0:
        return ""
    damping = 2 * _SWING * np.sqrt(G / length) * mass * length**2
    return (f'<body pos="{robot.length[k]} 0 0"><joint name="p{lane}_{k}" type="hinge" '
            f'axis="0 -1 0" damping="{damping}"/>{_inertial(mass, 1e-9, length)}</body>')


def _bending_link(robot: DrawnRobot, p: Parameters, lane: int, k: int, weightless: float) -> str:
    """Link of three lumps with a spring between neighbours; straight, it is the stated link."""
    mass, inertia = robot.mass[k], robot.inertia[k]
    apart = np.sqrt(1.5 * _SPREAD * inertia / mass)
    own = (1 - _SPREAD) * inertia / 3
    stiffness = p["link_stiffness"][k]
    damping = 2 * _RING * np.sqrt(stiffness * mass / 3 * apart**2)
    hinge = f'type="hinge" axis="0 -1 0" stiffness="{stiffness}" damping="{damping}"/>'
    end = _inertial(mass / 3, own, apart / 2)
    far = (f'<body pos="{apart} 0 0" gravcomp="{weightless}"><joint name="g{lane}_{k}" {hinge}'
           f'{end}</body>')
    near = (f'<body pos="{robot.com[k] - apart / 2} 0 0" gravcomp="{weightless}">'
            f'<joint name="f{lane}_{k}" {hinge}{end}{far}</body>')
    return _inertial(mass / 3, own, robot.com[k] - apart) + near


def _mounted(robot: DrawnRobot, p: Parameters, lane: int, chain: str) -> str:
    """Whole robot on a base that yields to its torques, if its mount is soft."""
    stiffness = p["mount_stiffness"][0]
    if stiffness <= 0:
        return chain
    inertia = float(robot.link[0])
    damping = 2 * _MOUNT * np.sqrt(stiffness * inertia)
    return (f'<body gravcomp="1"><joint name="m{lane}_0" type="hinge" axis="0 -1 0" '
            f'stiffness="{stiffness}" damping="{damping}"/>{_inertial(_SPECK, inertia, 0.0)}'
            f'{chain}</body>')


def _weightless(robot: DrawnRobot, p: Parameters) -> float:
    """Share of its weight that the mounting takes: all of it when level, less when tilted."""
    return 0.0 if robot.gravity else 1.0 - np.sin(p["tilt"][0])


def _tip(robot: DrawnRobot, p: Parameters, lane: int) -> str:
    if not p["wall"].any():
        return ""
    return (f'<geom name="tip{lane}" type="sphere" size="0.0001" pos="{robot.length[-1]} 0 0" '
            'mass="0" contype="0" conaffinity="0"/>')


def _mass(mass: float, at: np.ndarray, weightless: float) -> str:
    if mass <= 0:
        return ""
    return (f'<body pos="{_triple(at)}" gravcomp="{weightless}">{_inertial(mass, 1e-9, 0.0)}'
            '</body>')


def _triple(values: np.ndarray) -> str:
    return " ".join(f"{value}" for value in values)


def _inertial(mass: float, inertia: float, com: float) -> str:
    return (f'<inertial pos="{com} 0 0" mass="{mass}" '
            f'diaginertia="{inertia} {inertia} {inertia}"/>')
