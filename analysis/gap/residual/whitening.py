"""From a prediction error to a white residual that no unknown initial state explains."""

import dataclasses
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import (
    Noise,
    Rows,
    rows_of,
    sensor_noise_model,
    whiten,
)
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses
from clie_blocks.analysis.gap.residual.unknown_states import (
    counted_part,
    counted_rows,
    shared_rows,
    unknown_responses,
)

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
        One per joint, of the first log and of all that have its rows.
    initial_responses : list of list of ndarray
        ``initial_responses[j][k]``: orthonormal whitened responses of joint k to an unknown
        state in log j, at its start and behind its gaps.
    method : Method
        Thresholds of everything that reads the residuals.
    counted : tuple of (ndarray or None)
        Whitened rows of each log that rest on measured samples; None where all do.  The others
        are zero.
    other_noises : mapping
        Log -> its noises, for logs with other rows than the first, or of the other encoder.
    deadline : float
        Reading of `time.monotonic` from which no search and no fit goes on [s].

    """

    problem: Problem
    noises: tuple[Noise, ...]
    initial_responses: list[list[np.ndarray]]
    method: Method
    counted: tuple[np.ndarray | None, ...] = ()
    other_noises: Mapping[int, tuple[Noise, ...]] = dataclasses.field(default_factory=dict)
    deadline: float = math.inf

    @property
    def is_out_of_time(self) -> bool:
        """Whether the time for a search is over: what was fitted by now has to do."""
        return time.monotonic() > self.deadline

    def rows(self, j: int) -> Rows:
        """Rows in which log j is compared."""
        return rows_of(self.problem.logs[j], self.problem.period)

    def noise(self, j: int, k: int) -> Noise:
        """Noise of joint k in the rows of log j."""
        return self.other_noises.get(j, self.noises)[k]

    @property
    def floors(self) -> np.ndarray:
        """RMS of the error of each joint that sensor noise leaves, over both encoders [rad]."""
        if not self.problem.two_encoders:
            return np.array([noise.floor for noise in self.noises])
        squares = [[self.noise(j, k).floor**2 for k in range(self.problem.n)]
                   for j in range(len(self.problem.logs))]
        return np.sqrt(np.mean(squares, axis=0))

    def whitened(self, error: np.ndarray, j: int) -> list[np.ndarray]:
        """Residual of each joint for an error (N, n) of log j, without the initial response."""
        if np.abs(error).max() >= DIVERGED:
            return [self._diverged(j, k) for k in range(self.problem.n)]
        error = self.rows(j).of_samples(error)
        return [self._white(error[:, k], j, k) for k in range(self.problem.n)]

    def of_runs(self, runs: np.ndarray, j: int) -> list[np.ndarray]:
        """Residuals of each joint for runs in log j, one row per run.

        The runs are simulated positions (runs, n, N), sample by sample or averaged as
        `Simulator.means` does.
        """
        rows = self.rows(j)
        measured, means = rows.of_samples(self.problem.logs[j].q), runs
        if runs.shape[-1] > len(measured):
            means = np.moveaxis(rows.of_samples(np.moveaxis(runs, -1, 0)), 0, -1)
        sound = np.abs(means).max(axis=(1, 2)) < DIVERGED
        residuals = []
        for k in range(self.problem.n):
            error = np.where(sound, measured[:, k, None] - means[:, k].T, 0.0)
            white = self._white(error, j, k)
            residuals.append(np.where(sound, white, self._diverged(j, k)[:, None]).T)
        return residuals

    def _white(self, error: np.ndarray, j: int, k: int) -> np.ndarray:
        return self.without_initial_response(whiten(error, self.noise(j, k).whitener), j, k)

    def _diverged(self, j: int, k: int) -> np.ndarray:
        """Residual of a model that diverges: a constant, initial response or not."""
        large = np.full(len(self.initial_responses[j][k]), DIVERGED / self.noise(j, k).sigma)
        return counted_part(large, self._counted(j))

    def without_initial_response(self, x: np.ndarray, j: int, k: int) -> np.ndarray:
        """Part of a whitened signal (or of columns) that no unknown state explains."""
        basis, x = self.initial_responses[j][k], counted_part(x, self._counted(j))
        return x - basis @ (basis.T @ x)

    def samples(self, part: np.ndarray, j: int, k: int) -> float:
        """Whitened samples that count in a residual of joint k in log j.

        What is free behind gaps takes up a sample each.
        """
        counted, gaps = self._counted(j), max(self.initial_responses[j][k].shape[1] - 2, 0)
        return float((len(part) if counted is None else np.count_nonzero(counted)) - gaps)

    def _counted(self, j: int) -> np.ndarray | None:
        return self.counted[j] if self.counted else None


def residual_model(problem: Problem, hypothesis: JointModel, method: Method,
                   noise_model: NoiseModel = sensor_noise_model) -> ResidualModel:
    """Return the residual model of a hypothesis: noises, and responses to an unknown state."""
    inertia, damping = hypothesis.values["inertia"], hypothesis.values["damping"]
    impulses = [noise_responses(problem, k, inertia, damping) for k in range(problem.n)]
    noises: dict[int, tuple[Noise, ...]] = {}
    for group in shared_rows(problem.logs, problem.period):
        of_group = problem if len(group) == len(problem.logs) else problem.with_log_list(
            [problem.logs[j] for j in group])
        found = tuple(noise_model(of_group, k, impulses[k]) for k in range(problem.n))
        noises.update(dict.fromkeys(group, found))
    responses = [[unknown_responses(problem, inertia, damping, k, log, noises[j][k])
                  for k in range(problem.n)] for j, log in enumerate(problem.logs)]
    counted = tuple(counted_rows(log, problem.period) for log in problem.logs)
    others = {j: own for j, own in noises.items() if own is not noises[0]}
    return ResidualModel(problem, noises[0], responses, method, counted, others)


def unweighted(residuals: ResidualModel, hypothesis: JointModel) -> ResidualModel:
    """Residual model of the errors as the gap counts them: over the noise, all frequencies alike.

    The states that are unknown are those of the joint model of a hypothesis.
    """
    problem, values = residuals.problem, hypothesis.values
    plain = dataclasses.replace(
        residuals, noises=_without_filter(residuals.noises),
        other_noises={j: _without_filter(own) for j, own in residuals.other_noises.items()})
    return dataclasses.replace(plain, initial_responses=[
        [unknown_responses(problem, values["inertia"], values["damping"], k, log,
                           plain.noise(j, k)) for k in range(problem.n)]
        for j, log in enumerate(problem.logs)])


def _without_filter(noises: tuple[Noise, ...]) -> tuple[Noise, ...]:
    """Noises with a filter that leaves errors as they are, in the rows of the whitened ones."""
    return tuple(dataclasses.replace(
        noise, whitener=np.eye(1, len(noise.whitener))[0] / noise.floor) for noise in noises)
