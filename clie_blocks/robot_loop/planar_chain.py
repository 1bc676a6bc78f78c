"""Known rigid-body terms of a planar chain of links, over whole time series.

Angles as in the paper: q1 = 0 is horizontal, every other joint relative to the link before it.
Torques are joint side [N m]; the mass matrix is that of all links, without the rotors.

In the absolute angles phi_i = q_1 + ... + q_i the chain is simple: its mass matrix is
P_ij cos(phi_i - phi_j) with constants P, its centrifugal torque P_ij sin(phi_i - phi_j) dphi_j^2.
A joint turns all links behind it, so its row is the sum of theirs.
"""

import dataclasses
from typing import Any, ClassVar

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class PlanarChain:
    """Links of the robot, and which of their terms the nominal model holds.

    Parameters
    ----------
    length, mass, com, inertia, bearing_damping : ndarray, shape (n,)
        As in `Links`; zero where not stated.
    g : float
        Acceleration of gravity [m/s^2].
    has_gravity, has_coupling : bool
        Terms of the nominal model.
    diagonal : ndarray, shape (n,)
        Diagonal of the mass matrix at the pose of the experiments [kg m^2].
    known : bool
        The link data are stated.

    """

    length: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    bearing_damping: np.ndarray
    g: float | np.ndarray
    has_gravity: bool
    has_coupling: bool
    diagonal: np.ndarray
    known: bool

    parameters: ClassVar[tuple[str, ...]] = (
        "length", "mass", "com", "inertia", "bearing_damping", "g", "diagonal")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.length)


def mass_matrix(chain: PlanarChain, q: np.ndarray) -> list[list[Any]]:
    """Mass matrix as n rows of n entries [kg m^2]; q (..., n) may hold a time series."""
    n, constant = chain.n, _constants(chain)
    pair = {(i, j): constant[i][j] * cosine for (i, j), (cosine, _) in _turns(q).items()}
    pair.update({(i, i): constant[i][i] for i in range(n)})
    rows: list[list[Any]] = [[0.0] * n for _ in range(n + 1)]
    for a in reversed(range(n)):
        tail: Any = 0.0
        for b in reversed(range(a, n)):
            tail = pair[a, b] + tail
            rows[a][b] = rows[b][a] = tail + rows[a + 1][b]
    return rows[:n]


def weights(chain: PlanarChain) -> list[Any]:
    """Moment of each link, and of all it carries at its end [N m]."""
    own = chain.g * chain.mass * chain.com
    return [own[i] + chain.g * chain.length[i] * _sum([chain.mass[k]
                                                       for k in range(i + 1, chain.n)])
            for i in range(chain.n)]


def gravity_torque(chain: PlanarChain, q: np.ndarray, shift: float = 0.0) -> np.ndarray:
    """Weight of the links [N m] for q (..., n); `shift` [rad] turns the direction of gravity."""
    angle = _absolute(q)
    torque = [weight * np.cos(angle[i] + shift) for i, weight in enumerate(weights(chain))]
    return np.stack(_carried_by(torque), axis=-1)


def coriolis_torque(chain: PlanarChain, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Coriolis and centrifugal torque of the links [N m]; zero for one."""
    n, constant, speed = chain.n, _constants(chain), _absolute(dq)
    if n == 1:
        return 0.0 * q
    square, turns = [w * w for w in speed], _turns(q)
    torque: list[list[np.ndarray]] = [[] for _ in range(n)]
    for i in range(n):
        for j in range(i + 1, n):
            pull = constant[i][j] * turns[i, j][1]
            torque[i].append(-pull * square[j])
            torque[j].append(pull * square[i])
    return np.stack(_carried_by([_sum(parts) for parts in torque]), axis=-1)


def coupling_torque(chain: PlanarChain, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
                    ) -> np.ndarray:
    """Torque of inertia coupling, of the change of inertia, and Coriolis [N m]."""
    if chain.n == 1:
        return 0.0 * q
    return (inertial_torque(chain, q, ddq) - chain.diagonal * ddq
            + coriolis_torque(chain, q, dq))


def inertial_torque(chain: PlanarChain, q: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Mass matrix times acceleration [N m], shape (..., n)."""
    return np.stack([_sum([m * ddq[..., j] for j, m in enumerate(row)])
                     for row in mass_matrix(chain, q)], axis=-1)


def tip_load_torque(chain: PlanarChain, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray,
                    ) -> np.ndarray:
    """Torque of a unit mass at the tip [N m/kg], with its weight where gravity acts."""
    unit = unit_tip_chain(chain)
    torque = inertial_torque(unit, q, ddq) + coriolis_torque(unit, q, dq)
    return torque + gravity_torque(unit, q) if chain.has_gravity else torque


def unit_tip_chain(chain: PlanarChain) -> PlanarChain:
    """Chain with the same lengths whose only mass is 1 kg at the tip."""
    return dataclasses.replace(chain, mass=np.eye(chain.n)[-1], com=chain.length,
                               inertia=np.zeros(chain.n))


def _constants(chain: PlanarChain) -> list[list[Any]]:
    """Upper triangle of P: inertia of link i about its joint, and moments of links i < j."""
    n = chain.n
    constant: list[list[Any]] = [[None] * n for _ in range(n)]
    for j in range(n):
        carried = _sum([chain.mass[k] for k in range(j + 1, n)])
        moment = chain.mass[j] * chain.com[j] + chain.length[j] * carried
        for i in range(j):
            constant[i][j] = chain.length[i] * moment
        constant[j][j] = (chain.inertia[j] + chain.mass[j] * chain.com[j] * chain.com[j]
                          + chain.length[j] * chain.length[j] * carried)
    return constant


def _turns(q: np.ndarray) -> dict[tuple[int, int], tuple[np.ndarray, np.ndarray]]:
    """Cosine and sine of the angle from link i to every link j behind it, by (i, j).

    Angles add up along the chain, so that products take the place of most sines.
    """
    turns = {}
    for j in range(1, q.shape[-1]):
        cosine, sine = turns[j - 1, j] = np.cos(q[..., j]), np.sin(q[..., j])
        for i in range(j - 1):
            cosine_before, sine_before = turns[i, j - 1]
            turns[i, j] = (cosine_before * cosine - sine_before * sine,
                           sine_before * cosine + cosine_before * sine)
    return turns


def _absolute(q: np.ndarray) -> list[np.ndarray]:
    """Sums q_1 + ... + q_i, one per joint."""
    angles = [q[..., 0]]
    for k in range(1, q.shape[-1]):
        angles.append(angles[-1] + q[..., k])
    return angles


def _carried_by(torque: list[Any]) -> list[Any]:
    """Torque at every joint of torques that act on the links: those of all links behind it."""
    sums = [torque[-1]]
    for part in reversed(torque[:-1]):
        sums.append(part + sums[-1])
    return sums[::-1]


def _sum(parts: list[Any]) -> Any:
    return sum(parts[1:], parts[0]) if parts else 0.0
