"""Robots that exist twice: in MuJoCo's language and as a plant with an effect of the catalogue."""

from dataclasses import dataclass
from typing import Any

import control as ct

from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.effect import Setting
from clie_blocks.joints import inertial_joints
from clie_blocks.manipulator import GRAVITY

STEP = 1e-4  # s, of both engines
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
    angles: tuple[tuple[float, ...], ...] = ((1.0,),)
    torque: float = 2.0
    gravity: float = 0.0
    why: str = "methods of integration"


_MOTOR = '<general name="{0}" joint="{0}" {1}/>'


def _body(joint: str, inertia: float, inside: str = "", *, mass: float = 1.0, at: str = "0 0 0",
          com: str = "0 0 0") -> str:
    """Body on one hinge; positive angles lift a link along x out of the horizontal."""
    return (f'<body pos="{at}"><inertial pos="{com}" mass="{mass}" diaginertia="{inertia} '
            f'{inertia} {inertia}"/><joint type="hinge" axis="0 -1 0" {joint}/>{inside}</body>')


def _single(effect: Setting, joint: str = "", motor: str = "", *, inertia: float = 0.8,
            **options: Any) -> Robot:
    plain = inertial_joints([inertia], [UNDAMPED], [0.0])
    return Robot(_body(f'name="a" {joint}', inertia), _MOTOR.format("a", motor),
                 with_effects(plain, [effect]), plain, **options)


def _viscous() -> Robot:
    return _single(LIBRARY["viscous"](extra=0.5), 'damping="0.5"')


def _armature() -> Robot:
    return _single(LIBRARY["inertia"](extra=0.3), 'armature="0.3"')


def _coulomb() -> Robot:
    return _single(LIBRARY["coulomb"](level=0.6, width=1e-4),
                   'frictionloss="0.6" solreffriction="0.0002 1" '
                   'solimpfriction="0.9999 0.9999 0.001 0.5 2"',
                   why="MuJoCo's friction is a soft constraint, made stiff here; ours is smoothed "
                       "over 0.1 mrad/s")


def _saturation() -> Robot:
    return _single(LIBRARY["actuator_saturation"](limit=1.5), "", 'forcerange="-1.5 1.5"')


def _torque_gain() -> Robot:
    return _single(LIBRARY["torque_gain_error"](error=0.1), "", 'gear="1.1"')


def _lag() -> Robot:
    return _single(LIBRARY["actuator_lag"](lag=0.01), "", 'dyntype="filter" dynprm="0.01"')


def _delay() -> Robot:
    # Linear interpolation between the rows runs half a step ahead of holding them.
    return _single(LIBRARY["time_delay"](delay=0.01 - STEP / 2), "",
                   'delay="0.01" nsample="110" interp="linear"',
                   why="edges of the held torque; ours is an approximant")


def _two_hinges(effect: Setting, spring: str, **options: Any) -> Robot:
    motor, link = 0.8, 0.4
    plain = inertial_joints([motor + link], [UNDAMPED], [0.0])
    return Robot(_body('name="a"', motor, _body(f'name="b" {spring}', link)),
                 _MOTOR.format("a", ""), with_effects(plain, [effect]), plain, ((1.0, 1.0),),
                 **options)


def _elasticity() -> Robot:
    effect = LIBRARY["joint_elasticity"](compliance=1 / 400.0, damping=0.5, motor_inertia=0.8)
    return _two_hinges(effect, 'stiffness="400" damping="0.5"')


def _backlash() -> Robot:
    effect = LIBRARY["backlash"](half_gap=0.02, stiffness=2000.0, damping=0.0, motor_inertia=0.8)
    # A limit of small impedance is a spring: its stiffness per inertia of the two bodies,
    # 2000 (1/0.8 + 1/0.4).  Of large impedance it would be rigid.
    spring = ('range="-0.02 0.02" solreflimit="-7500 0" '
              'solimplimit="0.0001 0.0001 0.001 0.5 2"')
    return _two_hinges(effect, spring, why="both step over the moment of the touch")


def _gravity() -> Robot:
    mass, reach = 0.5, 0.4
    plain = inertial_joints([0.8 + mass * reach**2], [UNDAMPED], [0.0])
    plant = with_effects(plain, [LIBRARY["gravity"](weight=mass * reach * GRAVITY)])
    return Robot(_body('name="a" armature="0.8"', 1e-9, mass=mass, com=f"{reach} 0 0"),
                 _MOTOR.format("a", ""), plant, plain, gravity=GRAVITY)


def _payload() -> Robot:
    mass, reach = 0.5, 0.4
    plain = inertial_joints([0.8], [UNDAMPED], [0.0])
    effect = LIBRARY["payload"](mass=mass, length=reach, gear_ratio=1.0)
    tip = f'<body pos="{reach} 0 0"><inertial pos="0 0 0" mass="{mass}" ' \
          'diaginertia="1e-9 1e-9 1e-9"/></body>'
    return Robot(_body('name="a"', 0.8, tip), _MOTOR.format("a", ""),
                 with_effects(plain, [effect]), plain, gravity=GRAVITY)


def _coupling() -> Robot:
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
    "actuator_lag": _lag, "actuator_saturation": _saturation, "torque_gain_error": _torque_gain,
    "gravity": _gravity, "payload": _payload, "coupling": _coupling}
