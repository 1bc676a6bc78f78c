"""The terms of the simulated robot: sampled law, joints, links, and pieces of effects.

One period of the controller is one step: measure, command, hold, move.  Dry friction acts as an
impulse that can stop a joint but never reverse it, so that a stuck joint stays stuck (time
stepping, as in rigid-body contact).

Everything is plain numpy on arrays of shape (n,), without branches, so that the same function
runs as it stands and as machine code.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from clie_blocks.robot_loop.links import Links, bias_torque, gravity_torque, mass_rows

DELAY_TAPS = 60  # samples of a delay line
FRICTION_SWEEPS = 4  # over the joints, in which the friction impulses of coupled joints settle


@dataclasses.dataclass(frozen=True)
class Piece:
    """What one effect adds to the simulated robot.

    Parameters
    ----------
    port : str
        ``sensor``  act(s, z, p) -> measured q, z, whose memory starts as the position;
        ``drive``   act(s, z, p) -> torque, mean over a period, z;
        ``load``    act(s, z, p) -> torque that opposes, z;
        ``friction`` act(s, z, p) -> largest torque against forward and against backward motion, z;
        ``body``    act(s, p) -> own mass, mass shared with the other joints, and torque;
        ``transmission`` act(twist, rate, z, h, p, link, motor) -> torque from motor to link, z
        a step h later; the last two are their inertias.
        `s` is a `State`, at a sensor and a drive with what the pieces before it made of q and u;
        `p` holds the parameters of the effect, `z` its memory, one array (n,) per state.
    act : callable
        See above.
    states : int
        Memory per joint.
    split : callable or None
        Of a transmission, ``split(robot, p)``: at which joints motor and link move apart, the
        link's inertia [kg m^2], and the damping behind the gear [N m s/rad]; None where `p` holds
        them as shares of what is stated.
    of_link : bool
        Of a sensor: it lies between motor and link, so that only an encoder of the link sees it.
    reads_record : bool
        Of a drive: it reads the recorded command beside that of the model.

    """

    port: str
    act: Callable[..., Any]
    states: int = 0
    split: Callable[..., Any] | None = None
    of_link: bool = False
    reads_record: bool = False

    @property
    def identity(self) -> str:
        """What tells it from every other piece, the same in every process."""
        own = getattr(self.act, "identity", None) or getattr(self.act, "__qualname__", "")
        return f"{self.port} {self.states} {self.act.__module__} {own}"


Memory = dict[str, list[np.ndarray]]
"""Memory of each block, one array (n,) per state."""
Parameters = Mapping[str, Any]
"""Arrays (n,), and one mapping of arrays per block."""
Values = Mapping[str, np.ndarray]
"""Parameters of a simulator by key."""
NamedPieces = Sequence[tuple[str, Piece]]
"""What the effects add, with the name of the block."""


class Named(Protocol):
    """A parameter of a cause, as the simulation sees it."""

    @property
    def name(self) -> str:
        """Its name."""


class ActingCause(Protocol):
    """A cause, as the simulation sees it: the name of its block, what it adds, its parameters."""

    @property
    def block(self) -> str:
        """Name of its block."""

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """What it adds to the simulated robot."""

    @property
    def numbers(self) -> Sequence[Named]:
        """Its parameters."""


@dataclasses.dataclass(frozen=True)
class State:
    """What a piece may read at one instant: signals, time, period, links and gear ratios.

    The recorded command is NaN, or not there, where there is no record.
    """

    q: np.ndarray
    dq: np.ndarray
    u: np.ndarray
    t: float | np.ndarray
    h: float
    links: Links
    ratio: np.ndarray
    recorded: np.ndarray | None = dataclasses.field(default=None, kw_only=True)

    @property
    def carried(self) -> np.ndarray:
        """Torque that the gear carries: weight and velocity torque of the links, motor side."""
        return bias_torque(self.links, self.q, self.dq) / self.ratio


def measured_position(s: State, memory: Memory, pieces: NamedPieces, p: Parameters,
                      ) -> tuple[np.ndarray, Memory]:
    """Position as the controller sees it [rad], and the memory of its pieces one sample later."""
    return _passed_on("q", s, memory, _at(pieces, "sensor"), p)


def law_command(q: np.ndarray, q_d: np.ndarray, pe: np.ndarray, memory: Sequence[np.ndarray],
                start: np.ndarray, clipped: bool, p: Parameters,
                ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Command of the sampled law, started at rest at a measured position, and its memory after."""
    rate, after = formed_velocity(q - start, memory, p["b"], p["a"])
    u = p["kp"] * (q_d - q) - p["kd"] * rate + pe
    return limited(u, clipped, p), after


def formed_velocity(x: np.ndarray, memory: Sequence[np.ndarray], b: np.ndarray, a: np.ndarray,
                    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Velocity that a filter ``b, a``, three rows each, forms of a position, and its memory."""
    rate = b[0] * x + memory[0]
    return rate, (b[1] * x - a[1] * rate + memory[1], b[2] * x - a[2] * rate)


def limited(u: np.ndarray, clipped: bool, p: Parameters) -> np.ndarray:
    """Command within the limit of the drive, where there is one."""
    return np.clip(u, -p["saturation"], p["saturation"]) if clipped else u


def delivered_torque(s: State, memory: Memory, pieces: NamedPieces, p: Parameters,
                     ) -> tuple[np.ndarray, Memory]:
    """Torque that leaves the drive, and the memory of its pieces one sample later."""
    return _passed_on("u", s, memory, _at(pieces, "drive"), p)


def _passed_on(signal: str, s: State, memory: Memory, pieces: NamedPieces, p: Parameters,
               ) -> tuple[np.ndarray, Memory]:
    """A signal after some pieces, each of which reads what those before it made of it."""
    after: Memory = {}
    for name, piece in pieces:
        value, after[name] = piece.act(s, memory[name], p[name])
        s = dataclasses.replace(s, **{signal: value})
    return getattr(s, signal), after


def opposing_torque(s: State, memory: Memory, pieces: NamedPieces, p: Parameters,
                    ) -> tuple[np.ndarray, Memory]:
    """Sum of the torques that oppose [N m], and the memory of their pieces one sample later."""
    torque, after = p["damping"] * s.dq + p["load"], {}
    for name, piece in _at(pieces, "load"):
        added, after[name] = piece.act(s, memory[name], p[name])
        torque = torque + added
    return torque, after


def dry_friction(s: State, memory: Memory, pieces: NamedPieces, p: Parameters,
                 ) -> tuple[tuple[np.ndarray, ...] | None, Memory]:
    """Largest friction torque against forward and against backward motion [N m], or None.

    With the memory of the pieces one sample later.
    """
    limits, after = [], {}
    for name, piece in _at(pieces, "friction"):
        sides, after[name] = piece.act(s, memory[name], p[name])
        limits.append(sides)
    return tuple(sum(side[1:], side[0]) for side in zip(*limits)) if limits else None, after


def velocity_after_friction(dq: np.ndarray, own: np.ndarray, cross: np.ndarray | None,
                            limits: tuple[np.ndarray, ...] | None, h: float) -> np.ndarray:
    """Velocity after dry friction acted for a time h: it stops a joint, never reverses it.

    The impulses of coupled joints depend on each other; they settle in a few sweeps.
    """
    if limits is None:
        return dq
    forward, backward = limits
    if cross is None:
        return dq - np.clip(dq * own, -h * backward, h * forward) / own
    inverse, n = inverse_mass(own, cross), len(dq)
    effective = [1.0 / inverse[k][k] for k in range(n)]
    share = [[effective[k] * inverse[k][j] for j in range(n)] for k in range(n)]
    impulse = [0.0 * dq[k] for k in range(n)]
    for _ in range(FRICTION_SWEEPS):
        for k in range(n):
            newest_last = (*range(k + 1, n), *range(k))  # what a processor waits for
            to_stop = effective[k] * dq[k] - _sum(share[k][j] * impulse[j] for j in newest_last)
            impulse[k] = np.clip(to_stop, -h * backward[k], h * forward[k])
    return np.stack([dq[k] - _sum(inverse[k][j] * impulse[j] for j in range(n))
                     for k in range(n)])


def inverse_mass(own: np.ndarray, cross: np.ndarray) -> list[list[Any]]:
    """Inverse of the mass matrix as rows; the elimination needs no pivots."""
    n = len(own)
    rows = [[own[k] if j == k else cross[j][k] for j in range(n)] for k in range(n)]
    if n == 2:  # in closed form, which takes half the time
        (a, b), (c, d) = rows
        scale = 1.0 / (a * d - b * c)
        return [[scale * d, -scale * b], [-scale * c, scale * a]]
    for p in range(n):
        scale = 1.0 / rows[p][p]
        rows[p] = [scale if j == p else scale * rows[p][j] for j in range(n)]
        for k in range(n):
            if k != p:
                factor = rows[k][p]
                rows[k] = [-factor * scale if j == p else rows[k][j] - factor * rows[p][j]
                           for j in range(n)]
    return rows


def link_masses(s: State) -> list[list[Any]] | None:
    """Return the mass matrix of the links as rows; None where they couple no joints."""
    return mass_rows(s.links, s.q) if s.links.has_coupling else None


def link_terms(s: State, masses: list[list[Any]] | None, pieces: NamedPieces, p: Parameters,
               ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Mass of links and bodies beyond the stated diagonal, and their torque, motor side.

    `masses` are the `link_masses` of the same position.

    Returns
    -------
    own : ndarray, shape (n,)
        Diagonal of the mass matrix.
    cross : ndarray, shape (n, n), or None
        ``cross[j][k]`` multiplies the acceleration of joint j in the equation of joint k; None
        where nothing couples the joints.
    torque : ndarray, shape (n,)
        Gravity and Coriolis torque.

    """
    links, share, cross = s.links, 1.0 / s.ratio, None
    own = torque = np.zeros(links.n)
    if masses is not None:
        own, cross = split_mass(masses)
        own, cross = share * (own - links.diagonal), share * cross
        torque = share * bias_torque(links, s.q, s.dq)
    elif links.has_gravity:
        torque = share * gravity_torque(links, s.q)
    for name, piece in _at(pieces, "body"):
        more_own, more_cross, more_torque = piece.act(s, p[name])
        own, torque = own + more_own, torque + more_torque
        cross = more_cross if cross is None else cross + more_cross
    return own, cross if links.n > 1 else None, torque


def split_mass(rows: list[list[Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal of a mass matrix, and the whole of it."""
    return np.array([row[k] for k, row in enumerate(rows)]), np.array(rows)


def acceleration(torque: np.ndarray, own: np.ndarray, cross: np.ndarray | None) -> np.ndarray:
    """Solve own_k ddq_k + sum of cross_jk ddq_j = torque_k."""
    if cross is None:
        return torque / own
    return np.array([_sum(x * torque[j] for j, x in enumerate(row))
                     for row in inverse_mass(own, cross)])


def _sum(parts: Iterable[Any]) -> Any:
    first, *rest = parts
    return sum(rest, first)


def _at(pieces: NamedPieces, port: str) -> list[tuple[str, Piece]]:
    return [(name, piece) for name, piece in pieces if piece.port == port]
