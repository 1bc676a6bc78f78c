"""How joints move in one period of the controller: as one body each, or as motor and link apart.

Both follow the midpoint rule; dry friction acts as an impulse at the end of each half.
"""

import dataclasses
from typing import Any

import numpy as np

from clie_blocks.robot_loop.dynamics import (
    Memory,
    NamedPieces,
    Parameters,
    Piece,
    State,
    acceleration,
    dry_friction,
    link_masses,
    link_terms,
    opposing_torque,
    velocity_after_friction,
)
from clie_blocks.robot_loop.links import Links

TRANSMISSION_SUBSTEPS = 5  # of a period in which motor and link move apart
LARGEST_LINK_SHARE = 0.97  # of a joint's inertia: some is left to the motor

Limits = tuple[np.ndarray, ...] | None
"""Largest dry friction against forward and against backward motion, (n,) each."""
Mass = tuple[np.ndarray, np.ndarray | None]
"""Mass of each joint, and mass that is shared with the other joints."""
Motion = tuple[np.ndarray, ...]
"""Position and velocity of the joints; of joints that move apart, those of the motors, too."""


def move_as_one(now: State, memory: Memory, pieces: NamedPieces, p: Parameters,
                ) -> tuple[Motion, Memory]:
    """Motion after a period, of joints that are one body each.

    Position and time of the middle are known before, so both halves read them: the order is
    the same, and what depends on position alone is computed once.
    """
    h, q, dq = now.h, now.q, now.dq
    middle = dataclasses.replace(now, q=q + h / 2 * dq, t=now.t + h / 2)
    masses = link_masses(middle)
    ddq, limits, _, mass = _accelerate(middle, masses, memory, pieces, p)
    middle_rate = velocity_after_friction(dq + h / 2 * ddq, *mass, limits, h / 2)
    middle = dataclasses.replace(middle, dq=middle_rate)
    ddq, limits, after, mass = _accelerate(middle, masses, memory, pieces, p)
    end_rate = velocity_after_friction(dq + h * ddq, *mass, limits, h)
    return (q + h / 2 * (dq + end_rate), end_rate), after


def _accelerate(s: State, masses: list[list[Any]] | None, memory: Memory, pieces: NamedPieces,
                p: Parameters) -> tuple[np.ndarray, Limits, Memory, Mass]:
    torque, of_load = opposing_torque(s, memory, pieces, p)
    limits, of_friction = dry_friction(s, memory, pieces, p)
    own, cross, bias = link_terms(s, masses, pieces, p)
    own = p["inertia"] + own
    ddq = acceleration(s.u - torque - bias, own, cross)
    return ddq, limits, {**of_friction, **of_load}, (own, cross)


def move_apart(now: State, memory: Memory, pieces: NamedPieces, p: Parameters,
               ) -> tuple[Motion, Memory]:
    """Motion after a period, of motors and links that a loose or elastic transmission connects."""
    (q_motor,), (dq_motor,) = memory["q_motor"], memory["dq_motor"]
    motion: Motion = (now.q, now.dq, q_motor, dq_motor)
    after: Memory = {}
    bodies = _two_bodies(now, pieces, p)
    for _ in range(TRANSMISSION_SUBSTEPS):
        motion, after = bodies.move(motion, now, memory, now.h / TRANSMISSION_SUBSTEPS)
        memory = {**memory, bodies.name: after[bodies.name]}
    return motion, after


@dataclasses.dataclass(frozen=True, eq=False)
class _TwoBodies:
    """Motor and link of each joint, with the transmission between them.

    `name` is that of the transmission's block, which has a memory of its own within a period;
    `loose` is 1 at joints that move apart and 0 at joints that move as one; `link`, `motor` and
    `whole` are inertias [kg m^2], the last that of the link or of a joint that moves as one;
    `bearing` is the damping between link and motor [N m s/rad].
    """

    pieces: NamedPieces
    p: Parameters
    name: str
    transmission: Piece
    parameters: Parameters
    loose: Any
    link: np.ndarray
    motor: np.ndarray
    whole: np.ndarray
    bearing: np.ndarray

    def move(self, motion: Motion, now: State, memory: Memory, h: float) -> tuple[Motion, Memory]:
        """Motion after a step h, and the memory of the pieces after the period."""
        q, dq, q_m, dq_m = motion
        loose, pieces, p = self.loose, self.pieces, self.p
        q, q_m = q + h / 2 * dq, q_m + h / 2 * dq_m
        of_link = dataclasses.replace(now, q=q, dq=dq)
        of_motor = dataclasses.replace(now, q=q_m, dq=dq_m)
        passed, after = self.transmission.act(
            q_m - q, dq_m - dq, memory[self.name], h, self.parameters, self.link, self.motor)
        own, cross, bias = link_terms(of_link, link_masses(of_link), pieces, p)
        torque, of_load = opposing_torque(of_motor, memory, pieces, p)
        driven = now.u - torque
        own = self.whole + own
        ddq = acceleration(
            loose * passed + (1.0 - loose) * driven - bias - self.bearing * dq, own, cross)
        ddq_m = (driven - passed + self.bearing * dq_m) / self.motor
        dq = dq + h * ddq
        dq_m = dq_m + h * ddq_m
        limits, of_friction = dry_friction(of_motor, memory, pieces, p)
        if limits is not None:
            of_whole = tuple((1.0 - loose) * side for side in limits)
            dq = velocity_after_friction(dq, own, cross, of_whole, h)
            dq_m = velocity_after_friction(dq_m, self.motor, None, limits, h)
        q, q_m = q + h / 2 * dq, q_m + h / 2 * dq_m
        motion = q, dq, q + loose * (q_m - q), dq + loose * (dq_m - dq)
        return motion, {**of_friction, **of_load, self.name: after}


def _two_bodies(now: State, pieces: NamedPieces, p: Parameters) -> _TwoBodies:
    (name, transmission), = [(name, piece) for name, piece in pieces
                             if piece.port == "transmission"]
    of_piece = p[name]
    if transmission.split is not None:
        loose, link, behind = transmission.split(p, of_piece)
    else:
        loose = of_piece["loose"]
        link, damping = link_share_of_joint(now.links, now.ratio, p, of_piece["link_share"])
        behind = of_piece["bearing_share"] * damping
    motor = p["inertia"] - link
    return _TwoBodies(
        pieces, p, name, transmission, of_piece, loose, link, motor,
        whole=link + (1.0 - loose) * motor,
        bearing=loose * behind)


def link_share_of_joint(links: Links, ratio: np.ndarray, p: Parameters, share: np.ndarray,
                        ) -> tuple[np.ndarray, np.ndarray]:
    """Inertia and damping of the link alone, motor side.

    The inertia is a share of the stated one, or of the whole joint where no links are stated.
    """
    stated = links.diagonal / ratio if links.known else p["inertia"]
    damping = links.bearing_damping / ratio if links.known else 0.0 * p["damping"]
    return np.minimum(share * stated, LARGEST_LINK_SHARE * p["inertia"]), damping
