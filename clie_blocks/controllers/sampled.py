"""Parts of sampled control laws: velocity filters, sums, and their hold at a limit."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError, signals, vector
from clie_blocks.linear_filters import CORNERS, DISCRETISATIONS, two_corner_filter

HOLDS = ("conditional", "back_calculation", "none")  # of an integral where the command is limited
UNLIMITED = 1e9  # a limit that no command meets
Coefficients = tuple[ArrayLike, ArrayLike]
Memory = Sequence[np.ndarray]
Params = Mapping[str, np.ndarray]
Parts = tuple[np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]]
LawParts = Callable[[np.ndarray, Memory, np.ndarray, np.ndarray, np.ndarray, Params], Parts]


@dataclasses.dataclass(frozen=True)
class VelocityFilter:
    """Filter of second order from position to velocity, of one law.

    Parameters
    ----------
    period : float
        Sample time [s].
    coefficients : tuple of array_like, optional
        b and a in powers of 1/z, three at most; by default those of a difference.
    kind : str
        How G1 (47) is discretised, where `corners` are given.
    corners : tuple of array_like, optional
        High-pass and low-pass corner [rad/s]: parameters of the law.

    """

    period: float
    coefficients: Coefficients | None = None
    kind: str = "tustin"
    corners: tuple[ArrayLike, ArrayLike] | None = None

    def parameters(self, name: str, n: int) -> dict[str, np.ndarray]:
        """Corners by key, one per joint; empty for a filter of fixed coefficients."""
        if self.corners is None:
            return {}
        if self.kind not in DISCRETISATIONS:
            raise DiagramError(f"{name}: no discretisation is called {self.kind!r}; "
                               f"{nearest(self.kind, DISCRETISATIONS)}")
        return {key: vector(value, f"{name}: {key}", n=n, unit="rad/s", above=0)
                for key, value in zip(CORNERS, self.corners)}

    def __call__(self, x: np.ndarray, memory: Memory, params: Params,
                 ) -> tuple[np.ndarray, list[np.ndarray]]:
        """Output, and memory one sample later."""
        if self.corners is None:
            return filtered(x, memory, *self._fixed())
        return filtered(x, memory, *two_corner_filter(
            self.kind, self.period, *(params[key] for key in CORNERS)))

    def _fixed(self) -> tuple[np.ndarray, np.ndarray]:
        step = self.period
        b, a = self.coefficients or ((1.0 / step, -1.0 / step, 0.0), (1.0, 0.0, 0.0))
        padded = [np.pad(np.asarray(side, float), (0, 3 - len(np.atleast_1d(side))))
                  for side in (b, a)]
        return padded[0] / padded[1][0], padded[1] / padded[1][0]


def filtered(x: np.ndarray, memory: Memory, b: Sequence[Any] | np.ndarray,
             a: Sequence[Any] | np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Output of a filter of second order, and its memory one sample later."""
    y = b[0] * x + memory[0]
    return y, [b[1] * x - a[1] * y + memory[1], b[2] * x - a[2] * y]


def integral_step(free: np.ndarray, limited: np.ndarray, error: np.ndarray, step: np.ndarray,
                  hold: str, back: np.ndarray) -> np.ndarray:
    """Change of an integral part in one sample.

    Parameters
    ----------
    free, limited : ndarray, shape (n,)
        Command before and behind its limit.
    error, step : ndarray, shape (n,)
        What is integrated, and its contribution to the command in one sample.
    hold : str
        ``conditional``: it stands still while the command is limited and the error drives it
        further; ``back_calculation``: what the limit takes off flows back by the share `back` per
        sample; ``none``: it winds up.
    back : ndarray, shape (n,)
        Period over tracking time.

    """
    if hold == "conditional":
        return np.where((free != limited) & (error * free > 0.0), 0.0, step)
    if hold == "back_calculation":
        return step + back * (limited - free)
    return step


def law_with_integral(parts: LawParts, params: dict[str, np.ndarray], limit: np.ndarray,
                      period: float, hold: str, back: np.ndarray, name: str,
                      further: Sequence[str] = ()) -> ct.NonlinearIOSystem:
    """Law of an integral part, a filter of second order and a limit, as a block.

    Parameters
    ----------
    parts : callable
        ``parts(integral, memory, q_d, q, pe, params)``: command before its limit, error that is
        integrated, what it adds to the integral part in one sample, and memory of the filter.
    params : dict
        Parameters of the block, each of shape (n,).
    limit : ndarray, shape (n,)
        Largest command [N m].
    period : float
        Sample time [s].
    hold, back
        As for `integral_step`.
    name : str
        Name of the block.
    further : sequence of str
        Names of memory that `parts` has behind that of the filter.

    """
    n, rows = len(limit), 3 + len(further)

    def both(x: np.ndarray, u: np.ndarray, params: Params) -> tuple[np.ndarray, np.ndarray]:
        integral, *memory = (x[k * n:(k + 1) * n] for k in range(rows))
        free, error, step, after = parts(integral, memory, u[:n], u[n:2 * n], u[2 * n:], params)
        limited = np.clip(free, -limit, limit)
        grown = integral + integral_step(free, limited, error, step, hold, back)
        return np.concatenate((grown, *after)), limited

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return both(x, u, params)[0]

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return both(x, u, params)[1]

    return ct.nlsys(update, output, dt=period, name=name, params=params,
                    states=signals("integral", "velocity_1", "velocity_2", *further, n=n),
                    inputs=signals("q_d", "q", "pe", n=n), outputs=signals("u", n=n))


def checked(name: str, n: int, period: float, hold: str,
            **numbers: tuple[ArrayLike, str, float | None]) -> dict[str, np.ndarray]:
    """Numbers of a law by key, one per joint; each is given with its unit and its least value.

    Raises
    ------
    DiagramError
        If a number is out of range, the period is not positive, or the hold is not known.

    """
    if not period > 0:
        raise DiagramError(f"{name}: the period must be positive, got {period} s")
    if hold not in HOLDS:
        raise DiagramError(f"{name}: anti_windup = {hold!r} is not known; {nearest(hold, HOLDS)}")
    return {key: vector(value, f"{name}: {key}", n=n, unit=unit, least=least)
            for key, (value, unit, least) in numbers.items()}
