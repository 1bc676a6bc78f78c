"""From a prediction error to a white residual that no unknown initial state explains."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import Noise, decimated, sensor_noise_model, whiten
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses
from clie_blocks.linear_filters import lfilter

DIVERGED = 1e2  # rad: the error of a model that diverges

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
        initial state in log j.
    method : Method
        Thresholds of everything that reads the residuals.

    """

    problem: Problem
    noises: tuple[Noise, ...]
    initial_responses: list[list[np.ndarray]]
    method: Method

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
        return np.full(len(self.initial_responses[j][k]), DIVERGED / self.noises[k].sigma)

    def without_initial_response(self, x: np.ndarray, j: int, k: int) -> np.ndarray:
        """Part of a whitened signal (or of columns) that no unknown initial state explains."""
        basis = self.initial_responses[j][k]
        return x - basis @ (basis.T @ x)


def residual_model(problem: Problem, hypothesis: JointModel, method: Method,
                   noise_model: NoiseModel = sensor_noise_model) -> ResidualModel:
    """Return the residual model of a hypothesis: noises, and responses to an initial state."""
    inertia, damping = hypothesis.values["inertia"], hypothesis.values["damping"]
    noises = tuple(noise_model(problem, k, noise_responses(problem, k, inertia, damping))
                   for k in range(problem.n))

    def whitened_response(k: int, samples: int) -> np.ndarray:
        response = _initial_responses(problem, inertia, damping, k, samples)
        return _orthonormal(whiten(decimated(response, problem.period), noises[k].whitener))

    responses = [[whitened_response(k, len(log)) for k in range(problem.n)]
                 for log in problem.logs]
    return ResidualModel(problem, noises, responses, method)


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
