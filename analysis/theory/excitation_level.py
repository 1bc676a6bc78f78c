"""How well a motion excites the parameters: conditions (28), (42), (49), window by window."""

from collections.abc import Sequence
from dataclasses import dataclass

import control as ct
import numpy as np
from scipy.integrate import cumulative_trapezoid, trapezoid

from clie_blocks import paper
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.signals import signal

PARAMETER_WORDS = ("damping over inertia", "one over inertia", "constant load over inertia")
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Excitation:
    """Excitation in one window.

    Parameters
    ----------
    window : tuple of float
        Start and end [s].
    weighted : float
        The scalar (49), with all weights equal.
    eigenvalues : ndarray, shape (3n,)
        Those of the matrix in (28) or (42), smallest first.
    weakest : ndarray, shape (3n,)
        Unit vector of parameters that the window excites least.

    """

    window: tuple[float, float]
    weighted: float
    eigenvalues: np.ndarray
    weakest: np.ndarray

    @property
    def smallest(self) -> float:
        """beta_1 of (28): positive where all parameters are excited."""
        return float(self.eigenvalues[0])

    @property
    def largest(self) -> float:
        """beta_2 of (28)."""
        return float(self.eigenvalues[-1])

    @property
    def rank(self) -> int:
        """Number of parameter directions that are excited at all."""
        return int(np.sum(self.eigenvalues > RANK_TOLERANCE * self.largest))

    @property
    def condition_number(self) -> float:
        """Largest over smallest eigenvalue; infinite without full rank."""
        full = self.rank == self.eigenvalues.size
        return self.largest / self.smallest if full else float("inf")

    @property
    def weakest_in_words(self) -> str:
        """The parameter direction that is least excited, in words."""
        n = self.weakest.size // 3
        order = np.argsort(-np.abs(self.weakest))
        parts = [f"{self.weakest[p] / self.weakest[order[0]]:+.2f} {'abd'[p // n]}{p % n + 1}"
                 for p in order if abs(self.weakest[p]) > 0.1]
        first = order[0]
        return (f"{PARAMETER_WORDS[first // n]} of joint {first % n + 1}"
                + (f" ({' '.join(parts)} together)" if len(parts) > 1 else ""))


def excitation(phi: np.ndarray, time: np.ndarray, window: tuple[float, float]) -> Excitation:
    """Excitation (28), (49) of a regressor in a window.

    Parameters
    ----------
    phi : ndarray, shape (samples, 3n, n)
        Regressor: Phi_p for (28), Phi_f for (42).
    time : ndarray, shape (samples,)
        Time [s].
    window : tuple of float
        Start and end [s].

    Returns
    -------
    Excitation
        By the trapezoidal rule.

    Raises
    ------
    NotIdentifiableError
        If the window holds fewer than two samples.

    """
    rows = (time >= window[0] - 1e-9) & (time <= window[1] + 1e-9)
    if np.sum(rows) < 2:
        raise NotIdentifiableError(f"no samples between {window[0]:g} and {window[1]:g} s; the "
                                   f"run covers {time[0]:g} to {time[-1]:g} s")
    gramian = trapezoid(phi[rows] @ phi[rows].transpose(0, 2, 1), time[rows], axis=0)
    eigenvalues, vectors = np.linalg.eigh(gramian)
    return Excitation((window[0], window[1]), float(np.mean(np.sum(gramian, axis=1))), eigenvalues,
                      vectors[:, 0])


def weighted_integral(phi: np.ndarray, time: np.ndarray,
                      windows: Sequence[tuple[float, float]] = paper.WINDOWS,
                      ) -> list[tuple[np.ndarray, np.ndarray]]:
    """The integral (49) over time, reset at the start of each window, as in Fig. 3.

    Parameters
    ----------
    phi : ndarray, shape (samples, 3n, n)
        Regressor.
    time : ndarray, shape (samples,)
        Time [s].
    windows : sequence of (float, float)
        Windows [s].

    Returns
    -------
    list of (ndarray, ndarray)
        Time [s] and integral, per window.

    """
    power = np.sum(np.sum(phi, axis=1) ** 2, axis=1) / phi.shape[1]
    curves = []
    for start, end in windows:
        rows = (time >= start - 1e-9) & (time <= end + 1e-9)
        curves.append((time[rows], cumulative_trapezoid(power[rows], time[rows], initial=0)))
    return curves


def model_regressor(response: ct.TimeResponseData) -> np.ndarray:
    """Regressor Phi_p (22) along a run of an identification loop, shape (samples, 3n, n).

    Parameters
    ----------
    response : control.TimeResponseData
        With the outputs dq_model and u_model.

    """
    dq, u = signal(response, "dq_model").T, signal(response, "u_model").T
    rows = np.stack([dq, -u, np.ones_like(u)], axis=1)  # (samples, 3, n): diagonals of (22)
    n = u.shape[1]
    return (rows[..., None] * np.eye(n)).reshape(-1, 3 * n, n)


def filtered_regressor_of(response: ct.TimeResponseData) -> np.ndarray:
    """Regressor Phi_f (36) along a run that logged it, shape (samples, 3n, n).

    Parameters
    ----------
    response : control.TimeResponseData
        With the signal ``filtered_regressor.phi_f``.

    """
    flat = signal(response, "filtered_regressor.phi_f").T
    n = round(np.sqrt(flat.shape[1] / 3))
    return flat.reshape(-1, 3 * n, n)
