"""Causes between motor and link, where the two move apart; the encoder sees the link."""

from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.causes.cause import (
    Cause,
    EffectValues,
    Memory,
    Number,
    Probe,
    Scene,
    Values,
)
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects.backlash import contact_torque
from clie_blocks.effects.joint_elasticity import elastic_torque
from clie_blocks.effects.stiffening_elasticity import stiffening_torque
from clie_blocks.effects.torsional_hysteresis import hysteretic_torque, slip_step
from clie_blocks.robot_loop.dynamics import Piece
from clie_blocks.robot_loop.motion import link_share_of_joint

_CONTACT_DAMPING = 1.0
_CONTACTS = 60.0, 600.0, 1000.0  # rad/s at which touching bodies swing: least, first, largest
_GAPS = tuple(2e-4 * 2 ** (k / 2) for k in range(15))  # rad, half of the backlash
_CONSTRUCTION = (  # how the joint is built; see closed_loop.link_part for the first
    Number("link_share", "1", 0.02, 3.0, neutral=None, nuisance=True),  # of the stated inertia
    Number("bearing_share", "1", 0.0, 1.0, neutral=None, nuisance=True),  # of its drag, behind
    Number("loose", "1", fixed=True, switch=True))  # one where motor and link move apart

_SWING = (  # of the link on its spring, against a held motor
    Number("frequency", "Hz", 0.5, 80.0, neutral=80.0),
    Number("damping_ratio", "1", 0.0, 1.0, neutral=0.7))


def _constructions(scene: Scene) -> list[dict[str, np.ndarray]]:
    """Ways the joint may be built: its link as stated, or a few guesses."""
    every = 1.0 + 0 * scene.torque
    shares = (1.0,) if scene.problem.links.known else (0.2, 0.6)
    return [{"link_share": share * every, "bearing_share": 0.5 * every, "loose": every}
            for share in shares]


def _spring(p: Values, link: np.ndarray, motor: np.ndarray) -> dict[str, np.ndarray]:
    """Spring and damper of a joint whose link swings at a frequency against a held motor."""
    omega = 2 * np.pi * p["frequency"]
    return {"compliance": 1.0 / (link * omega * omega),
            "damping": 2 * p["damping_ratio"] * link * omega}


def _elastic(twist: np.ndarray, rate: np.ndarray, z: Memory, h: float, p: Values,
             link: np.ndarray, motor: np.ndarray) -> tuple[np.ndarray, Memory]:
    return elastic_torque(twist, rate, **_spring(p, link, motor)), z


def _two_bodies(cause: str, kernel: Callable[[Values, np.ndarray, np.ndarray], Values],
                ) -> Callable[[Problem, Values], EffectValues]:
    """Parameters of an effect with two bodies, from how a search takes the joint to be built."""
    def of_effect(problem: Problem, values: Values) -> EffectValues:
        p = {key.removeprefix(f"{cause}."): value for key, value in values.items()
             if key.startswith(f"{cause}.")}
        link, link_damping = link_share_of_joint(
            problem.links, problem.gear_ratio, values, p["link_share"])
        motor = values["inertia"] - link
        return {cause: {
            **kernel(p, link, motor), "motor_inertia": motor,
            "motor_damping": values["damping"] - p["bearing_share"] * link_damping}}
    return of_effect


JOINT_ELASTICITY = Cause(
    "joint_elasticity", (Piece("transmission", _elastic),),
    (*_SWING, *_CONSTRUCTION),
    lambda scene: [Probe({"frequency": f + 0 * scene.torque,
                          "damping_ratio": 0.05 + 0 * scene.torque, **built})
                   for built in _constructions(scene)
                   for f in (1.5, 2.2, 3.2, 4.5, 6.5, 9.0, 12.0, 17.0, 24.0, 34.0)],
    of_effect=_two_bodies("joint_elasticity", _spring))


def _soft_spring(p: Values, link: np.ndarray, motor: np.ndarray) -> dict[str, np.ndarray]:
    """Spring that swings at a frequency while it is soft, and what it becomes beyond a torque."""
    return {**_spring(p, link, motor), "stiffening": p["stiffening"], "knee": p["knee"]}


def _stiffening(twist: np.ndarray, rate: np.ndarray, z: Memory, h: float, p: Values,
                link: np.ndarray, motor: np.ndarray) -> tuple[np.ndarray, Memory]:
    return stiffening_torque(twist, rate, **_soft_spring(p, link, motor)), z


def _no_probes(scene: Scene) -> list[Probe]:
    """None: `search.elastic_gears` finds where they start, around an elastic gear."""
    return []


STIFFENING_ELASTICITY = Cause(
    "stiffening_elasticity", (Piece("transmission", _stiffening),),
    (*_SWING, Number("stiffening", "1", 0.0, 100.0), Number("knee", "N m", 1e-6, 1e4, neutral=None,
                                                         is_scale=True), *_CONSTRUCTION),
    _no_probes, without=("joint_elasticity", "stiffening"),
    of_effect=_two_bodies("stiffening_elasticity", _soft_spring))


def _slipping_spring(p: Values, link: np.ndarray, motor: np.ndarray) -> dict[str, np.ndarray]:
    """Spring that swings at a frequency beside a part that slips."""
    spring = _spring(p, link, motor)
    return {"stiffness": 1.0 / spring["compliance"], "damping": spring["damping"],
            "level": p["level"], "reach": p["reach"]}


def _hysteretic(twist: np.ndarray, rate: np.ndarray, z: Memory, h: float, p: Values,
                link: np.ndarray, motor: np.ndarray) -> tuple[np.ndarray, Memory]:
    parameters = _slipping_spring(p, link, motor)
    reach = parameters.pop("reach")
    middle = slip_step(z[0], rate, reach, h / 2)
    return (hysteretic_torque(twist, rate, middle, **parameters),
            [slip_step(z[0], rate, reach, h)])


TORSIONAL_HYSTERESIS = Cause(
    "torsional_hysteresis", (Piece("transmission", _hysteretic, states=1),),
    (*_SWING, Number("level", "N m", 0.0, 1e3),
     Number("reach", "rad", 1e-4, 0.5, neutral=None, is_scale=True), *_CONSTRUCTION),
    _no_probes, without=("joint_elasticity", "level"),
    of_effect=_two_bodies("torsional_hysteresis", _slipping_spring))


def _tooth(p: Values, link: np.ndarray, motor: np.ndarray) -> dict[str, np.ndarray]:
    """Gap, and stiffness and damping of a tooth at which the two bodies swing at a rate."""
    both = link * motor / (link + motor)
    return {"half_gap": p["half_gap"], "stiffness": both * p["contact"] ** 2,
            "damping": 2 * _CONTACT_DAMPING * both * p["contact"]}


def _backlash(twist: np.ndarray, rate: np.ndarray, z: Memory, h: float, p: Values,
              link: np.ndarray, motor: np.ndarray) -> tuple[np.ndarray, Memory]:
    return contact_torque(twist, rate, **_tooth(p, link, motor)), z


def _backlash_probes(scene: Scene) -> list[Probe]:
    """Widths of backlash, at one joint at a time where links couple, with its drag on either side.

    Backlash at one joint shakes the others, so no joint could be assessed next to a loose one.
    """
    every, links = 1.0 + 0 * scene.torque, scene.problem.links
    loose = list(np.eye(len(every))) if links.has_coupling else [every]
    drag = (0.0, 1.0) if np.any(links.bearing_damping > 0) else (0.0,)
    return [Probe({"half_gap": gap * every, "contact": _CONTACTS[1] * every, **built,
                   "bearing_share": share * every, "loose": where},
                  sizes={"bearing_share": 0.5 * every, "loose": every})
            for built in _constructions(scene) for where in loose for share in drag
            for gap in _GAPS]


BACKLASH = Cause(
    "backlash", (Piece("transmission", _backlash),),
    (Number("half_gap", "rad", 0.0, 0.1), *_CONSTRUCTION,
     Number("contact", "rad/s", _CONTACTS[0], _CONTACTS[2], neutral=None)),
    _backlash_probes, of_effect=_two_bodies("backlash", _tooth))
