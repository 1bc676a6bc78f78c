"""A law of the user's own as its models run it, on positions alone: at rest, and linearised there.

A velocity that it reads of the drive is the one that a model forms of its positions, by the filter
that comes nearest to the drive's.  A torque that it reads is its own command of the sample before,
as a drive without faults gives it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.law import Filter
from clie_blocks.errors import ClieError
from clie_blocks.robot_loop.dynamics import formed_velocity
from clie_blocks.robot_loop.sampled_law import TORQUE, VELOCITY, SampledLaw

NEGLIGIBLE = 1e-9  # of the largest entry of a linearisation: rounding of its differences
AT_REST = 1e-7  # of the largest state, by which a state at rest may change
ROWS = {VELOCITY: 2, TORQUE: 1}  # memory per joint of what a law reads of the drive


@dataclasses.dataclass(frozen=True, eq=False)
class LawOnPositions:
    """A law with all that its models give it; its state is that of the law and of these.

    Parameters
    ----------
    block : SampledLaw
        The law.
    parameters : ndarray, shape (m,)
        Its parameters.
    numerator, denominator : ndarray, shape (3, n)
        Filter by which a model forms the velocity that the law reads.

    """

    block: SampledLaw
    parameters: np.ndarray
    numerator: np.ndarray
    denominator: np.ndarray

    @property
    def states(self) -> int:
        """Number of states."""
        return self.block.states + self.block.n * sum(ROWS[port] for port in self.block.reads)

    def step(self, z: np.ndarray, start: np.ndarray, q: np.ndarray,
             ) -> tuple[np.ndarray, np.ndarray]:
        """Next state, and command, at a position beside the reference at which it started."""
        own, n = self.block.states, self.block.n
        rows, of_drive = list(z[own:].reshape(-1, n)), []
        after: tuple[np.ndarray, ...] = ()
        if VELOCITY in self.block.reads:
            rate, after = formed_velocity(q - start, rows[:2], self.numerator, self.denominator)
            of_drive.append(rate)
        if TORQUE in self.block.reads:
            of_drive.append(rows[-1] / np.array(self.block.scale))
        x, u = finite_step(self.block, z[:own], start, q, self.parameters, of_drive)
        given = [u] if TORQUE in self.block.reads else []
        return np.concatenate([x, *after, *given]), u

    def at_rest(self, start: np.ndarray) -> np.ndarray:
        """State that stays as it is while the joints rest at their references, at a position."""
        from scipy.optimize import least_squares

        def change(z: np.ndarray) -> np.ndarray:
            return self.step(z, start, start)[0] - z

        zero = np.zeros(self.states)
        if not self.states or not np.any(change(zero)):
            return zero
        columns = np.stack([change(unit) - change(zero) for unit in np.eye(self.states)], axis=1)
        at_once = -np.linalg.lstsq(columns, change(zero), rcond=NEGLIGIBLE)[0]
        if np.abs(change(at_once)).max() <= AT_REST * np.abs(at_once).max(initial=0.0):
            return at_once
        return least_squares(change, zero, xtol=1e-14, ftol=1e-14, gtol=1e-14).x

    def feedback(self, start: np.ndarray, rest: np.ndarray, h: float) -> tuple[Filter, ...]:
        """C(z) of each joint at rest, by differences of a width h.

        It has the states that the position of the joint moves and its command reads.
        """
        n, states = self.block.n, self.states

        def both(z: np.ndarray, q: np.ndarray) -> np.ndarray:
            return np.concatenate(self.step(z, start, q))

        by_state = [(both(rest + h * unit, start) - both(rest - h * unit, start)) / (2 * h)
                    for unit in np.eye(states)]
        by_position = [(both(rest, start + h * unit) - both(rest, start - h * unit)) / (2 * h)
                       for unit in np.eye(n)]
        jacobian = np.transpose([*by_state, *by_position])
        jacobian[np.abs(jacobian) < NEGLIGIBLE * np.abs(jacobian).max(initial=0.0)] = 0.0
        a, b = jacobian[:states, :states], jacobian[:states, states:]
        c, d = jacobian[states:, :states], jacobian[states:, states:]
        return tuple(_transfer(a, b[:, k], c[k], d[k, k]) for k in range(n))


def finite_step(block: SampledLaw, x: np.ndarray, q_d: np.ndarray, q: np.ndarray,
                parameters: np.ndarray, of_drive: Sequence[np.ndarray] = (),
                ) -> tuple[np.ndarray, np.ndarray]:
    """Next state and command of a law, refused where they are no numbers."""
    with np.errstate(all="ignore"):
        after, u = block.step(0.0, x, q_d, q, np.zeros(block.n), parameters, *of_drive)
    if not (np.isfinite(after).all() and np.isfinite(u).all()):
        raise ClieError(f"{block.name}: the law gives NaN or infinity with the joints at "
                        f"{np.round(q, 6).tolist()} rad and the references at "
                        f"{np.round(q_d, 6).tolist()} rad; keep roots, logarithms and divisions "
                        "off zero")
    return after, u


def _transfer(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: float) -> Filter:
    """Feedback ``-(d + c (z - a)^-1 b)`` in powers of 1/z, without states that take no part."""
    used = _reached(a, b != 0) & _reached(a.T, c != 0)
    a, b, c = a[np.ix_(used, used)], b[used], c[used]
    denominator = np.real(np.poly(a)) if used.any() else np.ones(1)
    numerator = np.real(np.poly(a - np.outer(b, c))) if used.any() else np.ones(1)
    return -(numerator + (d - 1.0) * denominator), denominator


def _reached(a: np.ndarray, first: np.ndarray) -> np.ndarray:
    """States that some first ones move, in any number of samples."""
    reached = first
    for _ in range(len(a)):
        wider = reached | ((a != 0) @ reached)
        if np.array_equal(wider, reached):
            break
        reached = wider
    return reached
