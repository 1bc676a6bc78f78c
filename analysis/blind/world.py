"""Robots as MuJoCo bodies; several stand side by side in one world and never touch."""

import numpy as np

from clie_blocks.analysis.blind.robot import G, link_inertia
from clie_blocks.errors import MissingExtraError

STEP = 5e-4  # s, of the engine
_SPECK = 1e-6  # kg, kg m^2: the engine refuses bodies without mass
_DRY = ('solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"')
_XML = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step}" gravity="0 0 {down}" integrator="RK4">
    <flag contact="disable" autoreset="disable"/>
  </option>
  <worldbody>{bodies}</worldbody>
  <actuator>{motors}</actuator>
</mujoco>"""


def world(robot, lanes):
    """Return a MuJoCo model that holds one copy of a robot per lane.

    Parameters
    ----------
    robot : Robot
        The robot.
    lanes : list of dict
        True numbers of each copy, see `neutral`.

    Returns
    -------
    mujoco.MjModel
        Joints are called ``a{lane}_{k}``, twists behind the motor ``b{lane}_{k}``.

    Raises
    ------
    MissingExtraError
        Without MuJoCo.

    """
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("making blind trials", "MuJoCo", "mujoco") from None
    build = _axes if robot.kind == "axes" else _chain
    return mujoco.MjModel.from_xml_string(_XML.format(
        step=STEP, down=-G,
        bodies="".join(build(robot, lane, j) for j, lane in enumerate(lanes)),
        motors="".join(_motor(robot, lane, j, k)
                       for j, lane in enumerate(lanes) for k in range(robot.n))))


def _chain(robot, p, lane):
    inside, weightless = "", _weightless(robot, p)
    for k in reversed(range(robot.n)):
        tip = _mass(p["payload"][k], robot.length[k], weightless)
        inertial = _inertial(robot.mass[k], robot.inertia[k], robot.com[k])
        at = robot.length[k - 1] if k else 0.0
        inside = _jointed(robot, p, lane, k, at, inertial + tip + inside, weightless)
    return inside


def _axes(robot, p, lane):
    turning = link_inertia(robot.kind, robot.length, robot.mass, robot.com, robot.inertia,
                           robot.pose)
    p = {**p, "rotor": p["rotor"] - turning / robot.ratio**2}
    return "".join(_jointed(robot, p, lane, k, 0.0, _inertial(_SPECK, turning[k], 0.0), 1.0)
                   for k in range(robot.n))


def _jointed(robot, p, lane, k, at, link, weightless):
    """Body behind a gear; positive angles lift a link along x out of the horizontal."""
    r2 = robot.ratio[k] ** 2
    hinge = (f'name="a{lane}_{k}" type="hinge" axis="0 -1 0" armature="{p["rotor"][k] * r2}" '
             f'frictionloss="1e-9" {_DRY} stiffness="{p["stiffness"][k]}" '
             f'springref="{p["rest"][k]}"')
    drag, quadratic = p["drag"][k] * r2, p["quadratic"][k] * robot.ratio[k]
    twist = _twist(p, lane, k)
    if not twist:
        return (f'<body pos="{at} 0 0" gravcomp="{weightless}"><joint {hinge} '
                f'damping="{drag + robot.bearing[k]} {quadratic} 0"/>{link}</body>')
    return (f'<body pos="{at} 0 0" gravcomp="1">{_inertial(_SPECK, _SPECK, 0.0)}'
            f'<joint {hinge} damping="{drag + robot.bearing[k]} {quadratic} 0"/>'
            f'<body gravcomp="{weightless}">{twist}{link}</body></body>')


def _twist(p, lane, k):
    """Second hinge behind the motor: a spring, or a gap between stiff flanks."""
    name = f'<joint name="b{lane}_{k}" type="hinge" axis="0 -1 0"'
    if p["half_gap"][k] > 0:
        return (f'{name} range="{-p["half_gap"][k]} {p["half_gap"][k]}" solreflimit="0.004 1" '
                'solimplimit="0.99 0.99 0.001 0.5 2"/>')
    if p["twist_stiffness"][k] > 0:
        return (f'{name} stiffness="{p["twist_stiffness"][k]}" '
                f'damping="{p["twist_damping"][k]}"/>')
    return ""


def _motor(robot, p, lane, k):
    limit = p["limit"][k]
    parts = [f'joint="a{lane}_{k}" gear="{robot.ratio[k] * p["gain"][k]}"']
    if np.isfinite(limit):
        parts.append(f'forcerange="{-limit} {limit}"')
    if p["lag"][k] > STEP / 2:  # the engine cannot follow what is faster, nor would it show
        parts.append(f'dyntype="filter" dynprm="{p["lag"][k]}"')
    if p["delay"][k] > 0:
        parts.append(f'delay="{p["delay"][k]}" nsample="{int(p["delay"][k] / STEP) + 4}" '
                     'interp="linear"')
    return f'<general {" ".join(parts)}/>'


def _weightless(robot, p):
    """Share of its weight that the mounting takes: all of it when level, less when tilted."""
    return 0.0 if robot.gravity else 1.0 - np.sin(p["tilt"][0])


def _mass(mass, at, weightless):
    if mass <= 0:
        return ""
    return (f'<body pos="{at} 0 0" gravcomp="{weightless}">{_inertial(mass, 1e-9, 0.0)}'
            '</body>')


def _inertial(mass, inertia, com):
    return (f'<inertial pos="{com} 0 0" mass="{mass}" '
            f'diaginertia="{inertia} {inertia} {inertia}"/>')
