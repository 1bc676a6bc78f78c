"""Effects of the catalogue against MuJoCo's own implementation of them.

``python analysis/effect_mujoco.py`` prints the table of `docs/effects_mujoco.md`; with ``-o FILE``
it writes it.  Needs the extra `mujoco`.
"""

import argparse
from dataclasses import dataclass

import control as ct
import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.errors import MissingExtraError, nearest
from clie_blocks.joints import inertial_joints
from clie_blocks.manipulator import GRAVITY
from clie_blocks.output import run_main, write
from clie_blocks.signals import DiagramError

STEP, DURATION = 1e-4, 3.0
UNDAMPED = 1e-12  # N m s/rad; our joints refuse zero


@dataclass(frozen=True)
class Robot:
    """One robot in both engines.

    Parameters
    ----------
    world, actuators : str
        Bodies and motors as MJCF.
    plant : control.NonlinearIOSystem
        The same with an effect of the catalogue.
    plain : control.NonlinearIOSystem
        Without it.
    angles : tuple of tuple of float
        Our q as sums of MuJoCo's joint angles.
    torque : float
        Size of the torque that drives it [N m].
    gravity : float
        Gravity along -z [m/s^2].
    why : str
        What bounds the agreement.

    """

    world: str
    actuators: str
    plant: ct.NonlinearIOSystem
    plain: ct.NonlinearIOSystem
    angles: tuple = ((1.0,),)
    torque: float = 2.0
    gravity: float = 0.0
    why: str = "methods of integration"


@dataclass(frozen=True)
class Comparison:
    """Largest difference of q between the engines, and what the effect changes of q [rad]."""

    effect: str
    difference: float
    size: float
    why: str


def compare(name):
    """Run one effect in both engines from rest under the same held torques.

    Parameters
    ----------
    name : str
        One of `ROBOTS`.

    Returns
    -------
    Comparison
        The figures.

    Raises
    ------
    MissingExtraError
        Without MuJoCo.
    DiagramError
        If there is no robot for that effect.

    """
    if name not in ROBOTS:
        raise DiagramError(f"no robot to compare {name!r} on; {nearest(name, ROBOTS)}")
    robot = ROBOTS[name]()
    rows = _torques(robot)
    theirs = _mujoco_angles(robot, rows)
    ours, without = (_our_angles(plant, rows) for plant in (robot.plant, robot.plain))
    return Comparison(name, float(np.max(np.abs(ours - theirs))),
                      float(np.max(np.abs(ours - without))), robot.why)


def _torques(robot):
    t = STEP * np.arange(round(DURATION / STEP))[:, None]
    n = np.arange(len(robot.angles))
    return robot.torque * (np.cos((5.0 + 2.0 * n) * t) + 0.5 * np.cos(17.0 * t + n))


def _our_angles(plant, rows):
    run = compile_diagram(plant).run(DURATION, STEP, "ode4", {"u": rows}, log="q")
    return np.asarray(run.outputs).reshape(rows.shape[1], -1)[:, :-1].T


def _mujoco_angles(robot, rows):
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("the comparison of engines", "MuJoCo", "mujoco") from None
    model = mujoco.MjModel.from_xml_string(_XML.format(
        step=STEP, gravity=robot.gravity, world=robot.world, actuators=robot.actuators))
    data = mujoco.MjData(model)
    found = np.empty((len(rows), model.nq))
    for k, row in enumerate(rows):
        found[k] = data.qpos
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
    return found @ np.array(robot.angles).T


_XML = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step}" gravity="0 0 -{gravity}" integrator="RK4">
    <flag contact="disable"/>
  </option>
  <worldbody>{world}</worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""
_MOTOR = '<motor name="{0}" joint="{0}" {1}/>'


def _body(joint, inertia, inside="", *, mass=1.0, at="0 0 0", com="0 0 0"):
    """Body on one hinge; positive angles lift a link along x out of the horizontal."""
    return (f'<body pos="{at}"><inertial pos="{com}" mass="{mass}" diaginertia="{inertia} '
            f'{inertia} {inertia}"/><joint type="hinge" axis="0 -1 0" {joint}/>{inside}</body>')


def _single(effect, joint="", motor="", *, inertia=0.8, **options):
    plain = inertial_joints([inertia], [UNDAMPED], [0.0])
    return Robot(_body(f'name="a" {joint}', inertia), _MOTOR.format("a", motor),
                 with_effects(plain, [effect]), plain, **options)


def _viscous():
    return _single(LIBRARY["viscous"](extra=0.5), 'damping="0.5"')


def _armature():
    return _single(LIBRARY["inertia"](extra=0.3), 'armature="0.3"')


def _coulomb():
    return _single(LIBRARY["coulomb"](level=0.6, width=1e-4),
                   'frictionloss="0.6" solreffriction="0.0002 1" '
                   'solimpfriction="0.9999 0.9999 0.001 0.5 2"',
                   why="MuJoCo's friction is a soft constraint, made stiff here; ours is smoothed "
                       "over 0.1 mrad/s")


def _saturation():
    return _single(LIBRARY["actuator_saturation"](limit=1.5), "", 'forcerange="-1.5 1.5"')


def _torque_gain():
    return _single(LIBRARY["torque_gain_error"](error=0.1), "", 'gear="1.1"')


def _delay():
    # Linear interpolation between the rows runs half a step ahead of holding them.
    return _single(LIBRARY["time_delay"](delay=0.01 - STEP / 2), "",
                   'delay="0.01" nsample="110" interp="linear"',
                   why="edges of the held torque; ours is an approximant")


def _two_hinges(effect, spring, **options):
    motor, link = 0.8, 0.4
    plain = inertial_joints([motor + link], [UNDAMPED], [0.0])
    return Robot(_body('name="a"', motor, _body(f'name="b" {spring}', link)),
                 _MOTOR.format("a", ""), with_effects(plain, [effect]), plain, ((1.0, 1.0),),
                 **options)


def _elasticity():
    effect = LIBRARY["joint_elasticity"](compliance=1 / 400.0, damping=0.5, motor_inertia=0.8)
    return _two_hinges(effect, 'stiffness="400" damping="0.5"')


def _backlash():
    effect = LIBRARY["backlash"](half_gap=0.02, stiffness=2000.0, damping=0.0, motor_inertia=0.8)
    # A limit of small impedance is a spring: its stiffness per inertia of the two bodies,
    # 2000 (1/0.8 + 1/0.4).  Of large impedance it would be rigid.
    spring = ('range="-0.02 0.02" solreflimit="-7500 0" '
              'solimplimit="0.0001 0.0001 0.001 0.5 2"')
    return _two_hinges(effect, spring, why="both step over the moment of the touch")


def _gravity():
    mass, reach = 0.5, 0.4
    plain = inertial_joints([0.8 + mass * reach**2], [UNDAMPED], [0.0])
    plant = with_effects(plain, [LIBRARY["gravity"](weight=mass * reach * GRAVITY)])
    return Robot(_body('name="a" armature="0.8"', 1e-9, mass=mass, com=f"{reach} 0 0"),
                 _MOTOR.format("a", ""), plant, plain, gravity=GRAVITY)


def _payload():
    mass, reach = 0.5, 0.4
    plain = inertial_joints([0.8], [UNDAMPED], [0.0])
    effect = LIBRARY["payload"](mass=mass, length=reach, gear_ratio=1.0)
    tip = f'<body pos="{reach} 0 0"><inertial pos="0 0 0" mass="{mass}" ' \
          'diaginertia="1e-9 1e-9 1e-9"/></body>'
    return Robot(_body('name="a"', 0.8, tip), _MOTOR.format("a", ""),
                 with_effects(plain, [effect]), plain, gravity=GRAVITY)


def _coupling():
    length, reach = 0.5, 0.3
    first, mass, second = 0.9, 0.7, 0.12  # second: inertia about the centre of mass
    turning = second + mass * reach**2
    alone = [first + mass * length**2 + turning, turning]
    plain = inertial_joints(alone, [UNDAMPED] * 2, [0.0] * 2)
    effect = LIBRARY["coupling"](moment=[0.0, mass * length * reach], turning=[0.0, turning])
    outer = _body('name="b"', second, mass=mass, at=f"{length} 0 0", com=f"{reach} 0 0")
    return Robot(_body('name="a"', first, outer), _MOTOR.format("a", "") + _MOTOR.format("b", ""),
                 with_effects(plain, [effect]), plain, ((1.0, 0.0), (0.0, 1.0)), torque=0.8)


ROBOTS = {
    "coulomb": _coulomb, "viscous": _viscous, "inertia": _armature,
    "joint_elasticity": _elasticity, "backlash": _backlash, "time_delay": _delay,
    "actuator_saturation": _saturation, "torque_gain_error": _torque_gain, "gravity": _gravity,
    "payload": _payload, "coupling": _coupling}

_PAGE = """# Effects against MuJoCo

Made by `python analysis/effect_mujoco.py -o docs/effects_mujoco.md`.

The same robot in both engines, from rest, driven for {duration:g} s by the same torques, held over
steps of {step:g} ms: MuJoCo {version} with RK4, ours with `ode4`.

{table}
"""


def page():
    """Return the text of `docs/effects_mujoco.md`."""
    rows = ["| effect | changes q by [rad] | engines differ by [rad] | what bounds it |",
            "| --- | --- | --- | --- |"]
    found = [compare(name) for name in ROBOTS]
    rows += [f"| `{c.effect}` | {c.size:.2g} | {c.difference:.1e} | {c.why} |" for c in found]
    import mujoco

    return _PAGE.format(duration=DURATION, step=1e3 * STEP, table="\n".join(rows),
                        version=mujoco.__version__)


def main(argv=None):
    """Print the page, or write it with ``-o FILE``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", metavar="FILE", help="write the page to this file")
    options = parser.parse_args(argv)
    text = page()
    print(write(options.o, text) if options.o else text)
    return 0


if __name__ == "__main__":
    run_main(main)
