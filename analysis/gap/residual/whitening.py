"""A hypothesis: the joint model with some causes at some joints, and its open numbers."""

import dataclasses
import functools
import weakref

import numpy as np

from clie_blocks.analysis.gap.residual.noise import decimated, sensor_noise_model, whiten
from clie_blocks.analysis.gap.residual.sensitivity import (
    noise_responses,
    sensor_sensitivity,
    torque_sensitivity,
)
from clie_blocks.linear_filters import lfilter

DIVERGED = 1e2  # rad: the error of a model that leaves every bound


@dataclasses.dataclass(frozen=True, eq=False)
class ResidualModel:
    """Everything that turns an error into a whitened residual.

    Parameters
    ----------
    problem : Problem
        The logs.
    noises : tuple of Noise
        One per joint.
    free : list of list of ndarray
        ``free[j][k]``: orthonormal whitened responses of joint k to an unknown start of log j.
    tangents : WeakKeyDictionary
        What `slopes.linearised` has found, for as long as the hypothesis is kept.
    freed : WeakKeyDictionary
        What `pruning.pruned` has made of a fit.

    """

    problem: object
    noises: tuple
    free: list
    tangents: object = dataclasses.field(default_factory=weakref.WeakKeyDictionary)
    freed: object = dataclasses.field(default_factory=weakref.WeakKeyDictionary)

    def whitened(self, error, j):
        """Residual of each joint for an error (N, n) of log j, without the free response."""
        if np.abs(error).max() >= DIVERGED:
            return [self._runaway(j, k) for k in range(self.problem.n)]
        error = decimated(error, self.problem.period)
        return [self.projected(whiten(error[:, k], self.noises[k].whitener), j, k)
                for k in range(self.problem.n)]

    def residuals(self, runs, j):
        """Residuals of each joint for runs in log j, a row per set.

        Parameters
        ----------
        runs : ndarray, shape (sets, n, N)
            Simulated positions, sample by sample or as `Simulator.means` averages them.
        j : int
            Log.

        """
        measured = decimated(self.problem.logs[j].q, self.problem.period)
        means = runs
        if runs.shape[-1] > len(measured):
            means = np.moveaxis(decimated(np.moveaxis(runs, -1, 0), self.problem.period), 0, -1)
        sound = np.abs(means).max(axis=(1, 2)) < DIVERGED
        found = []
        for k in range(self.problem.n):
            error = np.where(sound, measured[:, k, None] - means[:, k].T, 0.0)
            left = self.projected(whiten(error, self.noises[k].whitener), j, k)
            found.append(np.where(sound, left, self._runaway(j, k)[:, None]).T)
        return found

    def _runaway(self, j, k):
        """Residual of a model that leaves every bound: a constant, free response or not."""
        return np.full(len(self.free[j][k]), DIVERGED / self.noises[k].sigma)

    def projected(self, x, j, k):
        """Part of a whitened signal (or of columns) that an unknown start cannot explain."""
        basis = self.free[j][k]
        return x - basis @ (basis.T @ x)


def residual_model(problem, base):
    """Return the bench for a base hypothesis: noises, and responses to an unknown start."""
    inertia, damping = base.values["inertia"], base.values["damping"]
    noises = tuple(sensor_noise_model(problem, k, noise_responses(problem, k, inertia, damping))
                   for k in range(problem.n))
    response = functools.partial(_free_response, problem, inertia, damping)
    free = [[_orthonormal(whiten(decimated(response(k, len(log)), problem.period),
                                noises[k].whitener)) for k in range(problem.n)]
            for log in problem.logs]
    return ResidualModel(problem, noises, free)


def _free_response(problem, inertia, damping, k, samples):
    """Responses of the measured position to a start elsewhere, and to a start in motion."""
    kick = np.zeros(samples)
    kick[0] = 1.0
    b, a = torque_sensitivity(problem.law, k, inertia[k], damping[k])
    displaced = lfilter(*sensor_sensitivity(problem.law, k, inertia[k], damping[k]),
                        np.ones(samples))
    return np.stack([lfilter(b, a, kick), displaced], axis=1)


def _orthonormal(columns):
    return np.linalg.qr(columns / (np.sqrt((columns**2).sum(axis=0)) + 1e-300))[0]
