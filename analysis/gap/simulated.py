"""The robot as it is simulated: sampled law, joints, links, and pieces that an effect adds.

One period of the controller is one step: measure, command, hold, move.  Between two samples the
joints move by the midpoint rule; dry friction acts as an impulse that can stop a joint but never
turn it round, so that a stuck joint stays stuck (time stepping, as in rigid-body contact).  With
an elastic or loose transmission motor and link move apart, in shorter steps.

Everything is plain numpy on arrays of shape (n,), without branches, so that the same function
runs as it stands and as machine code.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.gap.links import coriolis_torque, gravity_torque, mass_entries

SUBSTEPS = 5
SWEEPS = 4  # for the friction impulses of coupled joints


@dataclasses.dataclass(frozen=True)
class Piece:
    """What one effect adds to the simulated robot.

    Parameters
    ----------
    port : str
        ``sensor``  act(q, p) -> measured q;
        ``drive``   act(u, z, p, h) -> u, z;
        ``load``    act(s, z, p) -> torque that opposes, z;
        ``friction`` act(s, p) -> largest torque against forward and against backward motion;
        ``body``    act(s, p) -> own mass, mass shared with the other joint, and torque;
        ``transmission`` act(twist, rate, p, link) -> torque from motor to link.
        `s` is a `State`; `p` holds the numbers of the effect, `z` its memory, one array (n,)
        per state; `h` is the period.
    act : callable
        See above.
    states : int
        Memory per joint.

    """

    port: str
    act: Callable
    states: int = 0


@dataclasses.dataclass(frozen=True)
class State:
    """What a piece may read at one instant: signals, time, period, links and gear ratios."""

    q: np.ndarray
    dq: np.ndarray
    u: np.ndarray
    t: float
    h: float
    chain: object
    ratio: np.ndarray


def measure(q, pieces, p):
    """Position as the controller sees it [rad]."""
    for name, piece in _at(pieces, "sensor"):
        q = piece.act(q, p[name])
    return q


def command(q, q_d, pe, memory, start, clipped, p):
    """Command of the sampled law, started at rest at a measured position, and its memory after."""
    b, a, x = p["b"], p["a"], q - start
    rate = b[0] * x + memory[0]
    after = (b[1] * x - a[1] * rate + memory[1], b[2] * x - a[2] * rate)
    u = p["kp"] * (q_d - q) - p["kd"] * rate + pe
    return (np.clip(u, -p["saturation"], p["saturation"]) if clipped else u), after


def delivered(u, memory, pieces, p, h):
    """Torque that leaves the drive, and the memory of its pieces one sample later."""
    after = {}
    for name, piece in _at(pieces, "drive"):
        u, after[name] = piece.act(u, memory[name], p[name], h)
    return u, after


def loads(s, memory, pieces, p):
    """Sum of the torques that oppose [N m], and the memory of their pieces one sample later."""
    torque, after = p["damping"] * s.dq + p["load"], {}
    for name, piece in _at(pieces, "load"):
        added, after[name] = piece.act(s, memory[name], p[name])
        torque = torque + added
    return torque, after


def dry_friction(s, pieces, p):
    """Largest friction torque against forward and backward motion [N m]."""
    forward = backward = 0.0 * s.dq
    for name, piece in _at(pieces, "friction"):
        plus, minus = piece.act(s, p[name])
        forward, backward = forward + plus, backward + minus
    return forward, backward


def stopped(dq, own, cross, limits, h):
    """Velocity after dry friction acted for a time h: it stops a joint, never reverses it.

    The impulses of two coupled joints depend on each other; a few sweeps settle them.
    """
    forward, backward = limits
    own, cross = inverse_mass(own, cross)
    impulse = np.clip(dq / own, -h * backward, h * forward)
    for _ in range(SWEEPS if len(dq) == 2 else 0):
        left = dq - cross * impulse[::-1]
        impulse = np.clip(left / own, -h * backward, h * forward)
    moved = dq - own * impulse
    return moved - cross * impulse[::-1] if len(dq) == 2 else moved


def inverse_mass(own, cross):
    """Diagonal and off-diagonal of the inverse of the mass matrix, row by row."""
    if len(own) != 2:
        return 1.0 / own, 0.0
    determinant = own * own[::-1] - cross * cross[::-1]
    return own[::-1] / determinant, -cross / determinant


def link_terms(s, pieces, p):
    """Mass of links and bodies beyond the stated diagonal, and their torque, motor side.

    Returns
    -------
    own, cross : ndarray, shape (n,)
        Diagonal and off-diagonal part of row k of the mass matrix; `cross` is for two links.
    torque : ndarray, shape (n,)
        Gravity and Coriolis torque.

    """
    chain, ratio = s.chain, s.ratio
    own = cross = torque = np.zeros(chain.n)
    if chain.has_coupling:
        m_11, m_12, m_22 = mass_entries(chain, s.q[1])
        own = np.array([m_11, m_22 + 0.0 * m_11]) - chain.diagonal
        own, cross = own / ratio, m_12 / ratio
        torque = coriolis_torque(chain, s.q, s.dq) / ratio
    if chain.has_gravity:
        torque = torque + gravity_torque(chain, s.q) / ratio
    for name, piece in _at(pieces, "body"):
        more_own, more_cross, more_torque = piece.act(s, p[name])
        own, cross, torque = own + more_own, cross + more_cross, torque + more_torque
    return own, cross, torque


def acceleration(torque, own, cross):
    """Solve own_k ddq_k + cross_k ddq_j = torque_k; with two joints j is the other one."""
    own, cross = inverse_mass(own, cross)
    return own * torque + cross * torque[::-1] if len(torque) == 2 else own * torque


def _at(pieces, port):
    return [(name, piece) for name, piece in pieces if piece.port == port]
