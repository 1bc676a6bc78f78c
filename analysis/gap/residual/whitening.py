"""From a prediction error to a white residual that no unknown initial state explains."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import (
    ORDER,
    Noise,
    decimated,
    sensor_noise_model,
    whiten,
)
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses
from clie_blocks.linear_filters import lfilter

DIVERGED = 1e2  # rad: the error of a model that diverges
LEAST_MEASURED = 0.5  # share of the samples in a mean that counts

NoiseModel = Callable[[Problem, int, Sequence[np.ndarray]], Noise]


class JointModel(Protocol):
    """A model with inertia and damping among its parameters."""

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Parameters by name."""


@dataclasses.dataclass(frozen=True, eq=False)
class ResidualModel:
    """Everything that turns an error into a whitened residual.

    Parameters
    ----------
    problem : Problem
        The logs.
    noises : tuple of Noise
        One per joint.
    initial_responses : list of list of ndarray
        ``initial_responses[j][k]``: orthonormal whitened responses of joint k to an unknown
        state in log j, at its start and behind each gap.
    method : Method
        Thresholds of everything that reads the residuals.
    counted : tuple of (ndarray or None)
        Whitened rows of each log that rest on measured samples; None where all do.  The others
        are zero.

    """

    problem: Problem
    noises: tuple[Noise, ...]
    initial_responses: list[list[np.ndarray]]
    method: Method
    counted: tuple[np.ndarray | None, ...] = ()

    def whitened(self, error: np.ndarray, j: int) -> list[np.ndarray]:
        """Residual of each joint for an error (N, n) of log j, without the initial response."""
        if np.abs(error).max() >= DIVERGED:
            return [self._diverged(j, k) for k in range(self.problem.n)]
        error = decimated(error, self.problem.period)
        return [self.without_initial_response(whiten(error[:, k], self.noises[k].whitener), j, k)
                for k in range(self.problem.n)]

    def of_runs(self, runs: np.ndarray, j: int) -> list[np.ndarray]:
        """Residuals of each joint for runs in log j, one row per run.

        The runs are simulated positions (runs, n, N), sample by sample or averaged as
        `Simulator.means` does.
        """
        measured = decimated(self.problem.logs[j].q, self.problem.period)
        means = runs
        if runs.shape[-1] > len(measured):
            means = np.moveaxis(decimated(np.moveaxis(runs, -1, 0), self.problem.period), 0, -1)
        sound = np.abs(means).max(axis=(1, 2)) < DIVERGED
        residuals = []
        for k in range(self.problem.n):
            error = np.where(sound, measured[:, k, None] - means[:, k].T, 0.0)
            white = self.without_initial_response(whiten(error, self.noises[k].whitener), j, k)
            residuals.append(np.where(sound, white, self._diverged(j, k)[:, None]).T)
        return residuals

    def _diverged(self, j: int, k: int) -> np.ndarray:
        """Residual of a model that diverges: a constant, initial response or not."""
        large = np.full(len(self.initial_responses[j][k]), DIVERGED / self.noises[k].sigma)
        return _where(self._counted(j), large)

    def without_initial_response(self, x: np.ndarray, j: int, k: int) -> np.ndarray:
        """Part of a whitened signal (or of columns) that no unknown state explains."""
        basis, x = self.initial_responses[j][k], _where(self._counted(j), x)
        return x - basis @ (basis.T @ x)

    def samples(self, part: np.ndarray, j: int) -> float:
        """Whitened samples that count in the residual of a joint in log j."""
        counted = self._counted(j)
        return float(len(part) if counted is None else np.count_nonzero(counted))

    def _counted(self, j: int) -> np.ndarray | None:
        return self.counted[j] if self.counted else None


def residual_model(problem: Problem, hypothesis: JointModel, method: Method,
                   noise_model: NoiseModel = sensor_noise_model) -> ResidualModel:
    """Return the residual model of a hypothesis: noises, and responses to an initial state."""
    inertia, damping = hypothesis.values["inertia"], hypothesis.values["damping"]
    noises = tuple(noise_model(problem, k, noise_responses(problem, k, inertia, damping))
                   for k in range(problem.n))

    counted = tuple(counted_rows(log, problem.period) for log in problem.logs)

    def whitened_response(k: int, j: int) -> np.ndarray:
        response = _state_responses(problem, inertia, damping, k, problem.logs[j])
        white = whiten(decimated(response, problem.period), noises[k].whitener)
        return _orthonormal(_where(counted[j], white))

    responses = [[whitened_response(k, j) for k in range(problem.n)]
                 for j in range(len(problem.logs))]
    return ResidualModel(problem, noises, responses, method, counted)


def counted_rows(log: Log, period: float) -> np.ndarray | None:
    """Whitened rows that rest on measured samples, and none that is mostly filled in."""
    if log.measured is None:
        return None
    seen = decimated(log.measured.astype(float), period) >= LEAST_MEASURED
    return whiten((~seen).astype(float), np.ones(ORDER + 1)) == 0.0


def _state_responses(problem: Problem, inertia: np.ndarray, damping: np.ndarray, k: int,
                     log: Log) -> np.ndarray:
    """Responses of the measured position to an unknown state at the start and behind each gap.

    Two columns each, for a speed and a position, shape (N, 2 m).
    """
    first = _initial_responses(problem, inertia, damping, k, len(log))
    behind = [np.pad(first, ((tick, 0), (0, 0)))[:len(log)] for tick in log.ends_of_gaps]
    return np.concatenate([first, *behind], axis=1) if behind else first


def _where(counted: np.ndarray | None, x: np.ndarray) -> np.ndarray:
    """Rows that count; the others are zero."""
    return x if counted is None else x * counted.reshape(-1, *[1] * (x.ndim - 1))


def _initial_responses(problem: Problem, inertia: np.ndarray, damping: np.ndarray, k: int,
                       samples: int) -> np.ndarray:
    """Responses of the measured position to an initial speed and an initial position, (N, 2)."""
    kick = np.zeros(samples)
    kick[0] = 1.0
    b, a = problem.law.torque_sensitivity(k, inertia[k], damping[k])
    displaced = lfilter(*problem.law.sensor_sensitivity(k, inertia[k], damping[k]),
                        np.ones(samples))
    return np.stack([lfilter(b, a, kick), displaced], axis=1)


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    return np.linalg.qr(columns / (np.sqrt((columns**2).sum(axis=0)) + 1e-300))[0]
