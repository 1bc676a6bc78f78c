"""The conditions and bounds when the parameters are known only to lie in a box.

Where a quantity is monotone in every parameter its worst value over the box is exact and lies at
a vertex.  K_bar, k_1 and the edge gains are monotone.  mu_0 is a product: its first factor is a
maximum of functions that are each monotone in every parameter, and the disturbance norm is
convex, so that each has its worst value at a vertex; where the two vertices differ the product
only bounds mu_0 from above, and the largest mu_0 over common vertices bounds it from below.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.theory.bounds import (
    Condition,
    ControlledJoints,
    Theorem2,
    Theorem4,
    condition,
    disturbance_norm,
    sampled_excitation,
    theorem_2,
    theorem_4,
    ultimate_bound,
)
from clie_blocks.signals import DiagramError, vector

MOST_VERTICES = 4096


@dataclass(frozen=True)
class ParameterBox:
    """Intervals of the parameters ``[a, b, d]``.

    Parameters
    ----------
    lower, upper : array_like, shape (3n,)
        Ends of the intervals [1/s, 1/(kg m^2), rad/s^2].

    """

    lower: np.ndarray
    upper: np.ndarray

    def __post_init__(self) -> None:
        lower, upper = vector(self.lower, "lower"), vector(self.upper, "upper")
        if lower.size != upper.size or lower.size % 3 or not np.all(lower <= upper):
            raise DiagramError("a parameter box needs lower <= upper, each with 3 entries a "
                               f"joint, got {self.lower} and {self.upper}")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    @classmethod
    def around(cls, theta: ArrayLike, relative: ArrayLike, absolute: ArrayLike = 0.0) -> Self:
        """Box of ``theta (1 +- relative) +- absolute``; both broadcast with theta."""
        theta = np.asarray(theta, float)
        half = np.abs(theta) * relative + absolute
        return cls(theta - half, theta + half)

    def vertices(self) -> Iterator[np.ndarray]:
        """Yield the vertices, shape (3n,) each; degenerate intervals count once."""
        ends = [(low,) if low == high else (low, high)
                for low, high in zip(self.lower, self.upper)]
        return (np.array(vertex) for vertex in product(*ends))

    def uniform_vertices(self) -> Iterator[np.ndarray]:
        """Yield the vertices at which all joints but one are at the same corner, (3n,) each."""
        ends, n = np.stack([self.lower, self.upper]), self.lower.size // 3
        corners = list(product((0, 1), repeat=3))
        for common, other, joint in product(corners, corners, range(n)):
            chosen = np.tile(np.array(common)[:, None], n)
            chosen[:, joint] = other
            yield np.take_along_axis(ends, chosen.reshape(1, -1), axis=0)[0]


@dataclass(frozen=True)
class WorstCase:
    """Worst values over a box.

    Parameters
    ----------
    condition : Condition
        Exact: K_bar and largest_kp rise with a and b, smallest_kd falls.
    eta_norm : float
        Exact: convex in b and d.
    mu_0 : tuple of float
        Bracket of the worst mu_0; both ends are equal where it is exact.  The lower end of
        robots with more than four joints is that of the vertices at which one joint differs.
    theorem_2 : Theorem2
        Exact: k_1 rises with a and b.
    theorem_4 : Theorem4
        Exact, for the same reason.

    """

    condition: Condition
    eta_norm: float
    mu_0: tuple[float, float]
    theorem_2: Theorem2
    theorem_4: Theorem4


def worst_case(box: ParameterBox, kp: ArrayLike, kd: ArrayLike, pe: Callable[[float], ArrayLike],
               *, alpha: float, eps_bar: float, horizon: float = 2.0) -> WorstCase:
    """Worst condition and bounds over a box of parameters.

    Parameters
    ----------
    box : ParameterBox
        Where the parameters lie.
    kp, kd : array_like, shape (n,)
        PD gains.
    pe : callable
        Excitation [N m].
    alpha : float
        Gain of the gradient method.
    eps_bar : float
        Bound on the modelling error [rad/s^2].
    horizon : float
        Time over which the excitation is evaluated [s].

    Returns
    -------
    WorstCase
        See there for what is exact.

    """
    slowest = ControlledJoints.from_theta(box.lower, kp, kd)
    eta_norm = worst_disturbance_norm(box, kp, kd, pe, horizon)
    common = [ultimate_bound(joints, disturbance_norm(joints, pe, horizon, step=1e-2)[0])
              for joints in _at_vertices(box, kp, kd)]
    above = worst_gain(box, kp, kd) * eta_norm
    return WorstCase(condition(slowest), eta_norm, (max(u.mu_0 for u in common), above),
                     theorem_2(slowest, eps_bar), theorem_4(slowest, alpha, eps_bar))


def worst_gain(box: ParameterBox, kp: ArrayLike, kd: ArrayLike) -> float:
    """Largest factor ``mu_0 / eta_norm`` over a box, exact.

    It is the maximum over pairs of joints (j, k) of ``norm_b`` at j times ``1/lambda_min_a`` at
    k.  The first rises with a_j and b_j, the second falls with a_k and b_k, and for j = k the
    product falls; so each pair is worst at a corner.

    Parameters
    ----------
    box : ParameterBox
        Where the parameters lie.
    kp, kd : array_like, shape (n,)
        PD gains.

    """
    low, high = (ControlledJoints.from_theta(end, kp, kd) for end in (box.lower, box.upper))
    inverse = 2 / np.minimum(low.a_bar, low.a_bar * low.b_bar)
    rising = np.hypot(1, high.a_bar / 2)
    same = np.hypot(1, low.a_bar / 2) * inverse
    pairs = np.outer(rising, inverse)
    np.fill_diagonal(pairs, same)
    return float(np.max(pairs))


def worst_disturbance_norm(box: ParameterBox, kp: ArrayLike, kd: ArrayLike,
                           pe: Callable[[float], ArrayLike], horizon: float = 2.0,
                           step: float = 1e-4) -> float:
    """Largest ``||B PE - D||`` over time and box: joint by joint at one of four corners, exact.

    Parameters
    ----------
    box : ParameterBox
        Where the parameters lie.
    kp, kd : array_like, shape (n,)
        PD gains; they fix the number of joints only.
    pe : callable
        Excitation [N m].
    horizon, step : float
        Time over which it is evaluated, and the grid [s].

    """
    n = ControlledJoints.from_theta(box.lower, kp, kd).n
    _, excitation = sampled_excitation(pe, n, horizon, step)
    low, high = np.reshape(box.lower, (3, n)), np.reshape(box.upper, (3, n))
    corners = [np.abs(b * excitation - d) for b in (low[1], high[1]) for d in (low[2], high[2])]
    return float(np.max(np.linalg.norm(np.max(corners, axis=0), axis=1)))


def _at_vertices(box: ParameterBox, kp: ArrayLike, kd: ArrayLike) -> list[ControlledJoints]:
    """Vertices of a box; of one with many those at which at most one joint differs."""
    few = 2.0 ** np.sum(box.lower < box.upper) <= MOST_VERTICES
    vertices = box.vertices() if few else box.uniform_vertices()
    return [ControlledJoints.from_theta(vertex, kp, kd) for vertex in vertices]
