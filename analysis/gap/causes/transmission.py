"""Causes between motor and link, where the two move apart; the encoder sees the link."""

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number, Probe
from clie_blocks.analysis.gap.simulated import Piece

CONTACT = 600.0  # rad/s: stiffness of a closed gap, as the frequency of the link on it
CONTACT_DAMPING = 1.0


def _elastic(twist, rate, p, link):
    omega = 2 * np.pi * p["frequency"]
    return link * omega * (omega * twist + 2 * p["damping_ratio"] * rate)


JOINT_ELASTICITY = Cause(
    "joint_elasticity", (Piece("transmission", _elastic),),
    (Number("frequency", "Hz", 0.5, 80.0, neutral=80.0),
     Number("damping_ratio", "1", 0.0, 1.0, neutral=0.7)),
    lambda scene: [Probe({"frequency": f + 0 * scene.torque,
                          "damping_ratio": 0.05 + 0 * scene.torque})
                   for f in (1.5, 2.2, 3.2, 4.5, 6.5, 9.0, 12.0, 17.0, 24.0, 34.0)])


def _backlash(twist, rate, p, link):
    half = p["half_gap"]
    pressed = twist - np.clip(twist, -half, half)
    touching = np.where(np.abs(twist) > half, 1.0, 0.0)
    torque = link * CONTACT * (CONTACT * pressed + 2 * CONTACT_DAMPING * touching * rate)
    return np.where(twist > 0.0, np.maximum(torque, 0.0), np.minimum(torque, 0.0))


BACKLASH = Cause(
    "backlash", (Piece("transmission", _backlash),),
    (Number("half_gap", "rad", 0.0, 0.1),),
    lambda scene: [Probe({"half_gap": gap + 0 * scene.torque})
                   for gap in (2e-4, 4e-4, 8e-4, 1.6e-3, 3e-3, 6e-3, 0.012, 0.025)])
