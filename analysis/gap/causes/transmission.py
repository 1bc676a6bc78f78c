"""Causes between motor and link, where the two move apart; the encoder sees the link."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number, Probe, Scene, Values
from clie_blocks.robot_loop.dynamics import Piece

_CONTACT_DAMPING = 1.0
_CONTACTS = 60.0, 600.0, 1000.0  # rad/s at which touching bodies swing: least, first, largest
_GAPS = tuple(2e-4 * 2 ** (k / 2) for k in range(15))  # rad, half of the backlash
_CONSTRUCTION = (  # how the joint is built; see closed_loop.link_part for the first
    Number("link_share", "1", 0.02, 3.0, neutral=None, nuisance=True),  # of the stated inertia
    Number("bearing_share", "1", 0.0, 1.0, neutral=None, nuisance=True),  # of its drag, behind
    Number("loose", "1", fixed=True, switch=True))  # one where motor and link move apart


def _constructions(scene: Scene) -> list[dict[str, np.ndarray]]:
    """Ways the joint may be built: its link as stated, or a few guesses."""
    every = 1.0 + 0 * scene.torque
    shares = (1.0,) if scene.problem.chain.known else (0.2, 0.6)
    return [{"link_share": share * every, "bearing_share": 0.5 * every, "loose": every}
            for share in shares]


def _elastic(twist: np.ndarray, rate: np.ndarray, p: Values, link: np.ndarray,
             motor: np.ndarray) -> np.ndarray:
    omega = 2 * np.pi * p["frequency"]
    return link * omega * (omega * twist + 2 * p["damping_ratio"] * rate)


JOINT_ELASTICITY = Cause(
    "joint_elasticity", (Piece("transmission", _elastic),),
    (Number("frequency", "Hz", 0.5, 80.0, neutral=80.0),
     Number("damping_ratio", "1", 0.0, 1.0, neutral=0.7), *_CONSTRUCTION),
    lambda scene: [Probe({"frequency": f + 0 * scene.torque,
                          "damping_ratio": 0.05 + 0 * scene.torque, **built})
                   for built in _constructions(scene)
                   for f in (1.5, 2.2, 3.2, 4.5, 6.5, 9.0, 12.0, 17.0, 24.0, 34.0)])


def _backlash(twist: np.ndarray, rate: np.ndarray, p: Values, link: np.ndarray,
              motor: np.ndarray) -> np.ndarray:
    half, contact, both = p["half_gap"], p["contact"], link * motor / (link + motor)
    pressed = twist - np.clip(twist, -half, half)
    touching = np.where(np.abs(twist) > half, 1.0, 0.0)
    torque = both * contact * (contact * pressed + 2 * _CONTACT_DAMPING * touching * rate)
    return np.where(twist > 0.0, np.maximum(torque, 0.0), np.minimum(torque, 0.0))


def _backlash_probes(scene: Scene) -> list[Probe]:
    """Widths of backlash, at one joint at a time where links couple, with its drag on either side.

    Backlash at one joint shakes the others, so no joint could be assessed next to a loose one.
    """
    every, chain = 1.0 + 0 * scene.torque, scene.problem.chain
    loose = list(np.eye(len(every))) if chain.has_coupling else [every]
    drag = (0.0, 1.0) if np.any(chain.bearing_damping > 0) else (0.0,)
    return [Probe({"half_gap": gap * every, "contact": _CONTACTS[1] * every, **built,
                   "bearing_share": share * every, "loose": where},
                  sizes={"bearing_share": 0.5 * every, "loose": every})
            for built in _constructions(scene) for where in loose for share in drag
            for gap in _GAPS]


BACKLASH = Cause(
    "backlash", (Piece("transmission", _backlash),),
    (Number("half_gap", "rad", 0.0, 0.1), *_CONSTRUCTION,
     Number("contact", "rad/s", _CONTACTS[0], _CONTACTS[2], neutral=None)),
    _backlash_probes)
