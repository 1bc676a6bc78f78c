"""Numbers of the robot file that may be wrong: hypotheses on the description, not on the robot.

A gear ratio, a mass, a length that is stated wrong moves the model in a way of its own, through
every term of the nominal model that contains the number.  So it is fitted like a cause, by its own
change, and is compared with the causes by what it leaves and by what it costs.  All of them have
one name, ``parametric``: the structure of the model is right.  The numbers of the joint model
(inertia, damping, offset of a drive) are refitted anyway, see `Nominal`.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    BodyTerms,
    Cause,
    Memory,
    Number,
    Probe,
    Scene,
    Values,
)
from clie_blocks.analysis.gap.causes.drive import counts_motor_turns
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.robot_loop.dynamics import Piece, State, split_mass
from clie_blocks.robot_loop.links import Links, bias_torque, gravity_torque, mass_rows

PARAMETRIC = "parametric"
"""The name of all of them."""
CHANGE = "change"
"""Their parameter: relative, of the link's length for a centre of mass, in rad for a zero."""
GEAR_RATIO, MASS, COM, LENGTH, INERTIA, ZERO = (
    "motor.gear_ratio", "links.mass_kg", "links.com_m", "links.length_m", "links.inertia_kgm2",
    "zero_rad")
SIZE = 0.1  # of a change that has a visible effect
_LEAST, _MOST = -0.9, 10.0  # of a relative change
_NO_ROTOR = 1e-9  # of the whole inertia


def _none(scene: Scene) -> list[Probe]:
    """None: a wrong number is not screened, its fit starts at the stated one."""
    return []


def _number(key: str, pieces: tuple[Piece, ...], lower: float = _LEAST, upper: float = _MOST,
            unit: str = "1", needs_links: bool = True) -> Cause:
    return Cause(PARAMETRIC, pieces, (Number(CHANGE, unit, lower, upper),), _none, variant=key,
                 needs_links=needs_links)


def _links_terms(links: Links, q: np.ndarray, dq: np.ndarray,
                 ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Diagonal and whole of the mass matrix, and torque, of what the model holds, joint side."""
    own, cross = split_mass(mass_rows(links, q))
    if links.has_coupling:
        return own, cross, bias_torque(links, q, dq)
    return own, 0.0 * cross, gravity_torque(links, q) if links.has_gravity else np.zeros(links.n)


def changed_links(s: State, links: Links, q: np.ndarray) -> BodyTerms:
    """Terms of other links, in another pose, less those of the stated ones, motor side."""
    pairs = zip(_links_terms(links, q, s.dq), _links_terms(s.links, s.q, s.dq))
    own, cross, torque = ((other - stated) / s.ratio for other, stated in pairs)
    return own, cross, torque


def _mass(s: State, p: Values) -> BodyTerms:
    return changed_links(s, s.links.with_changes(mass=p[CHANGE]), s.q)


def _com(s: State, p: Values) -> BodyTerms:
    return changed_links(s, s.links.with_changes(com=p[CHANGE]), s.q)


def _length(s: State, p: Values) -> BodyTerms:
    return changed_links(s, s.links.with_changes(length=p[CHANGE]), s.q)


def _inertia(s: State, p: Values) -> BodyTerms:
    return changed_links(s, s.links.with_changes(inertia=p[CHANGE]), s.q)


def _zero(s: State, p: Values) -> BodyTerms:
    return changed_links(s, s.links, s.q + p[CHANGE])


def _geared_torque(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    """Command over the change of the ratio: eq. (8) motor side, divided by it."""
    return s.u / (1.0 + p[CHANGE]), z


def _geared_links(s: State, p: Values) -> BodyTerms:
    """Links and bearings, which the motor feels by the square of the ratio."""
    share = 1.0 / (1.0 + p[CHANGE]) ** 2 - 1.0
    own, cross, torque = _links_terms(s.links, s.q, s.dq)
    if not s.links.has_coupling:
        own = s.links.diagonal
    bearing = s.links.bearing_damping * s.dq
    return (share * own / s.ratio, share * cross / s.ratio,
            share * (torque + bearing) / s.ratio)


def _link_of_motor(s: State, z: Memory, p: Values) -> tuple[np.ndarray, Memory]:
    """Position of a link that moves less than the motor over its stated ratio."""
    return s.q / (1.0 + p[CHANGE]), z


def _links_of_motors(s: State, p: Values) -> BodyTerms:
    """Links that move less than the motors over their stated ratios, as the motors feel them."""
    slope, links = 1.0 / (1.0 + p[CHANGE]), s.links
    own, cross, torque = _links_terms(links, slope * s.q, slope * s.dq)
    stated_own, stated_cross, stated_torque = _links_terms(links, s.q, s.dq)
    if not links.has_coupling:
        own = stated_own = links.diagonal
    bearing = (slope**2 - 1.0) * links.bearing_damping * s.dq
    return ((slope**2 * own - stated_own) / s.ratio, (slope**2 * cross - stated_cross) / s.ratio,
            (slope * torque - stated_torque + bearing) / s.ratio)


_DRIVE = Piece("drive", _geared_torque)
_GEAR = Piece("sensor", _link_of_motor, of_link=True)
_OF_MOTOR = _number(GEAR_RATIO, (_DRIVE,), needs_links=False)
_OF_LINKS = _number(GEAR_RATIO, (_DRIVE, Piece("body", _geared_links)))
_BETWEEN = _number(GEAR_RATIO, (_GEAR,), needs_links=False)  # of two encoders
_BETWEEN_LINKS = _number(GEAR_RATIO, (_GEAR, Piece("body", _links_of_motors)))
_MASS = _number(MASS, (Piece("body", _mass),))
_COM = _number(COM, (Piece("body", _com),), -2.0, 2.0)
_LENGTH = _number(LENGTH, (Piece("body", _length),))
_INERTIA = _number(INERTIA, (Piece("body", _inertia),), upper=100.0)
_ZERO = _number(ZERO, (Piece("body", _zero),), -np.pi, np.pi, "rad")


@dataclasses.dataclass(frozen=True)
class _Coupled:
    """What a wrong number of the links adds in an arm whose model leaves their coupling out."""

    act: Callable[[State, Values], BodyTerms]

    @property
    def identity(self) -> str:
        return f"coupled {self.act.__qualname__}"

    def __call__(self, s: State, p: Values) -> BodyTerms:
        coupled = dataclasses.replace(s.links, has_coupling=True)
        return self.act(dataclasses.replace(s, links=coupled), p)


_OF_COUPLED_LINKS = tuple(
    dataclasses.replace(cause, pieces=tuple(Piece(piece.port, _Coupled(piece.act))
                                            for piece in cause.pieces))
    for cause in (_MASS, _COM, _INERTIA, _LENGTH))


def is_number(cause: Cause) -> bool:
    """Whether a cause is a wrong number of the robot file, and no effect."""
    return cause.name == PARAMETRIC


def ratio_change(values: Values, n: int) -> np.ndarray:
    """Gear ratio over the stated one in a fitted model, shape (n,)."""
    return 1.0 + values.get(f"{_OF_MOTOR.block}.{CHANGE}", np.zeros(n))


def ratios_of_inertia(problem: Problem, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Changes of each gear ratio with which a command meets an inertia, the nearer one first.

    Motor side, the rotor counts by the ratio and the links by its inverse.  So there are two such
    ratios, one to either side of that at which rotor and links are equal; where none gives as
    little inertia, that one is returned.
    """
    links = problem.links.diagonal / problem.gear_ratio
    rotor = np.maximum(problem.nominal.inertia - links, _NO_ROTOR * problem.nominal.inertia)
    middle = inertia / (2.0 * rotor)
    apart = np.sqrt(np.maximum(middle**2 - links / rotor, 0.0))
    lower, upper = (np.clip(middle + side * apart - 1.0, _LEAST, _MOST) for side in (-1.0, 1.0))
    upper_is_near = np.abs(upper) <= np.abs(lower)
    return np.where(upper_is_near, upper, lower), np.where(upper_is_near, lower, upper)


def corrected_links(links: Links, values: Values) -> Links:
    """Links as a fitted model has them: refitted within tolerances, wrong numbers identified."""
    zero = np.zeros(links.n)
    refitted = dataclasses.replace(links, **{name: values.get(
        f"links.{name}", getattr(links, name)) for name in ("mass", "com", "inertia")})

    def change(cause: Cause) -> np.ndarray:
        return values.get(f"{cause.block}.{CHANGE}", zero)

    return refitted.with_changes(mass=change(_MASS), com=change(_COM), length=change(_LENGTH),
                                 inertia=change(_INERTIA))


def zero_change(values: Values, n: int) -> np.ndarray:
    """Angle of each joint where its log reads 0, shape (n,) [rad]."""
    return values.get(f"{_ZERO.block}.{CHANGE}", np.zeros(n))


def stated_numbers(problem: Problem) -> tuple[tuple[Cause, tuple[int, ...]], ...]:
    """Numbers that a robot file states and its model uses, and at which joints.

    Of links that neither weigh nor push each other in the nominal model nothing is used but their
    inertia, which the joint model refits.
    """
    robot, links, every = problem.robot, problem.links, tuple(range(problem.n))
    geared = tuple(k for k in every if counts_motor_turns(problem.gear_ratio[k]))
    found: list[tuple[Cause, tuple[int, ...]]] = []
    of_motor, of_links = ((_BETWEEN, _BETWEEN_LINKS) if problem.two_encoders
                          else (_OF_MOTOR, _OF_LINKS))
    if robot is not None and robot.motor.gear_ratio is not None and geared:
        found.append((of_links if links.known else of_motor, geared))
    if links.known and (links.has_gravity or links.has_coupling):
        found += [(_MASS, every), (_COM, every), (_INERTIA, every), (_ZERO, every)]
        if problem.n > 1:
            found.append((_LENGTH, every[:-1]))
    return tuple(found)


def is_of_coupling(cause: Cause) -> bool:
    """Whether a wrong number of coupled links means nothing without their coupling."""
    return any(isinstance(piece.act, _Coupled) for piece in cause.pieces)


def numbers_of_coupling(problem: Problem) -> tuple[tuple[Cause, tuple[int, ...]], ...]:
    """Numbers of the links beside a coupling that the nominal model leaves out, and their joints.

    The coupling is that of the stated links, so that it is wrong where their numbers are.
    """
    links, every = problem.links, tuple(range(problem.n))
    if not links.known or links.has_coupling or problem.n < 2:
        return ()
    return tuple((cause, every[:-1] if cause.variant == LENGTH else every)
                 for cause in _OF_COUPLED_LINKS)


def stated_and_identified(key: str, change: float, problem: Problem, k: int,
                          ) -> tuple[float, float, str]:
    """Stated and identified value of a number of joint k, and its unit.

    A zero is the angle of the joint where the log reads 0.
    """
    links = problem.links
    if key == COM:
        stated = float(links.com_along[k])
        return stated, stated + change * float(links.length[k]), "m"
    if key == ZERO:
        return 0.0, change, "rad"
    values, unit = {GEAR_RATIO: (problem.gear_ratio, "1"), MASS: (links.mass, "kg"),
                    LENGTH: (links.length, "m"), INERTIA: (links.spin_inertia, "kg m^2")}[key]
    return float(values[k]), float(values[k] * (1.0 + change)), unit
