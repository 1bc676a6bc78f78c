"""Least squares of a hypothesis in closed loop: simulate, whiten, step, keep what improves.

The residual is the whitened prediction error of all joints and fit logs, freed from the response
to an unknown start, with the distances from the datasheet appended.  Columns of the Jacobian are
finite differences of simulations; joints, and logs, are moved in one run where each acts on its
own rows.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.hypothesis import DIVERGED, SOFTNESS
from clie_blocks.analysis.gap.noise import decimated, white

CONVERGED = 1e-3
DAMPING = 1e-4
TRIES = 4


@dataclasses.dataclass(frozen=True, eq=False)
class Bench:
    """Everything that turns an error into a whitened residual.

    Parameters
    ----------
    problem : Problem
        The logs.
    noises : tuple of Noise
        One per joint.
    free : list of list of ndarray
        ``free[j][k]``: orthonormal whitened responses of joint k to an unknown start of log j.

    """

    problem: object
    noises: tuple
    free: list

    def whitened(self, error, j):
        """Residual of each joint for an error (N, n) of log j, without the free response."""
        if np.abs(error).max() >= DIVERGED:  # a constant, which a free response would explain
            return [np.full(len(basis), DIVERGED / noise.sigma)
                    for basis, noise in zip(self.free[j], self.noises)]
        error = decimated(error, self.problem.period)
        return [self.projected(white(error[:, k], self.noises[k].whitener), j, k)
                for k in range(self.problem.n)]

    def projected(self, x, j, k):
        """Part of a whitened signal (or of columns) that an unknown start cannot explain."""
        basis = self.free[j][k]
        return x - basis @ (basis.T @ x)


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis and how well it does.

    Parameters
    ----------
    hypothesis : Hypothesis
        With its fitted values.
    chi2 : ndarray, shape (logs, n)
        Whitened squared error of each log (those held out included) and joint.
    samples : ndarray, shape (logs, n)
        Whitened samples.
    stray : ndarray, shape (open,)
        Distances from the datasheet [sigma].
    covariance : ndarray, shape (open, open)
        Of the open numbers, from the Jacobian.
    iterations : int
        Steps that were kept.

    """

    hypothesis: object
    chi2: np.ndarray
    samples: np.ndarray
    stray: np.ndarray
    covariance: np.ndarray
    iterations: int

    @property
    def penalty(self):
        """Squared distances from the datasheet."""
        return float(self.stray @ self.stray)

    @property
    def cost(self):
        """chi^2 on the fit logs with the datasheet's penalty."""
        return float(self.chi2[:len(self.hypothesis.problem.fit)].sum() + self.penalty)

    @property
    def total(self):
        """chi^2 on all logs with the datasheet's penalty."""
        return float(self.chi2.sum() + self.penalty)


def fit(start, bench, iterations=6):
    """Fit a hypothesis to the fit logs, then judge it on all logs.

    Parameters
    ----------
    start : Hypothesis
        With values to start from.
    bench : Bench
        Whitening and free responses.
    iterations : int
        Most steps.

    """
    at, residual = start, _residual(start, bench)
    damping, kept, jacobian = DAMPING, 0, None
    for _ in range(iterations):
        jacobian = _jacobian(at, bench, residual)
        found = _better(at, bench, jacobian, residual, damping)
        if found is None:
            break
        gained = residual @ residual - found[1] @ found[1]
        at, residual, damping = found
        kept += 1
        if gained < CONVERGED * len(residual) + 1e-4 * (residual @ residual):
            break
    return judged(at, bench, jacobian, kept)


def _better(at, bench, jacobian, residual, damping):
    """First damped step that improves: ``hypothesis, residual, next damping``; None if none."""
    for _ in range(TRIES):
        proposal = _step(at, jacobian, residual, damping)
        tried = _residual(proposal, bench)
        if tried @ tried < residual @ residual:
            return proposal, tried, max(damping / 10, DAMPING)
        damping = 30 * max(damping, 1e-3)
    return None


def shrunk(start, bench, reference):
    """Return a start with smaller amplitudes, if as it is it does worse than a reference.

    Parameters
    ----------
    start : Hypothesis
        With numbers from a linear regression, which may reach too far.
    bench : Bench
        Whitening.
    reference : float
        Cost on the fit logs of the hypothesis without the causes.

    """
    amplitudes = [f"{member.name}.{number.name}" for member in start.members
                  for number in member.cause.numbers
                  if number.neutral == 0.0 and not number.fixed]
    for _ in range(TRIES):
        residual = _residual(start, bench)
        if residual @ residual < reference:
            break
        start = start.with_values({key: 0.3 * value if key in amplitudes else value
                                   for key, value in start.values.items()})
    return start


def judged(at, bench, jacobian=None, kept=0):
    """Return the fit of a hypothesis as it stands."""
    parts = [[part @ part for part in bench.whitened(at.error(j), j)]
             for j in range(len(at.problem.logs))]
    samples = [[len(bench.free[j][k]) for k in range(at.problem.n)]
               for j in range(len(at.problem.logs))]
    size = len(at.open)
    covariance = (np.full((size, size), np.inf) if jacobian is None
                  else np.linalg.pinv(jacobian.T @ jacobian, hermitian=True))
    scale = np.array([entry.size for entry in at.open])
    return Fit(at, np.array(parts), np.array(samples, float), at.stray(),
               covariance * np.outer(scale, scale), kept)


def _errors(at, bench):
    return [part for j in range(len(at.problem.fit)) for part in bench.whitened(at.error(j), j)]


def _residual(at, bench):
    return np.concatenate([*_errors(at, bench), at.stray()])


def _jacobian(at, bench, residual):
    """Columns d residual / d (value / size) of all open numbers."""
    n = at.problem.n
    groups = [[(i, *_difference(at, at.open[i])) for i in group] for group in _groups(at)]
    sets = [at.values, *(at.moved([(at.open[i], value) for i, value, _ in group])
                         for group in groups)]
    columns, row = np.zeros((len(residual), len(at.open))), 0
    for j in range(len(at.problem.fit)):
        plain, *moved = [bench.whitened(error, j) for error in at.errors(j, sets)]
        for k in range(n):
            rows = slice(row, row + len(plain[k]))
            row = rows.stop
            for group, parts in zip(groups, moved):
                for i, _, width in group:
                    if at.open[i].joint in (None, k) and at.open[i].log in (None, j):
                        columns[rows, i] = (parts[k] - plain[k]) / width
    for i, entry in enumerate(at.open):
        if entry.tolerance is not None and entry.stray(at.get(entry)) != 0.0:
            columns[row + i, i] = entry.size / entry.tolerance / SOFTNESS
    return columns


def _groups(at):
    """Open numbers that may move in the same run: one key, different joints and logs."""
    groups = {}
    for i, entry in enumerate(at.open):
        groups.setdefault(entry.key, []).append(i)
    return groups.values()


def _difference(at, entry):
    """Value a small step away, inside the bounds, and the step in units of the entry's size."""
    here = at.get(entry)
    step = 0.05 * max(entry.size, 0.2 * abs(here))
    if here + step > entry.upper:
        step = -step
    return here + step, step / entry.size


def _step(at, jacobian, residual, damping):
    scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-12
    normal = (jacobian / scale).T @ (jacobian / scale)
    normal[np.diag_indices_from(normal)] += damping
    delta = -np.linalg.solve(normal, (jacobian / scale).T @ residual) / scale
    moves = []
    for entry, change in zip(at.open, delta):
        here = at.get(entry)
        reach = 3 * max(abs(here), entry.size)
        value = here + np.clip(change * entry.size, -reach, reach)
        if entry.lower >= 0.0 and here > 0.0 and ".time" in entry.key or "range" in entry.key:
            value = np.clip(value, 0.4 * here, 2.5 * here)
        moves.append((entry, float(np.clip(value, entry.lower, entry.upper))))
    return at.with_values(at.moved(moves))


def tangent(found, bench):
    """Per joint, columns of a fit's numbers with their prior, and its residual, on the fit logs.

    Returns
    -------
    columns, residual : list of ndarray
        One of each per joint.  Below the rows of the residual, the columns carry one row per
        number: what the datasheet allows.  A number that does not act on the joint is left out.

    """
    at = found.hypothesis
    residual = _residual(at, bench)
    jacobian = _jacobian(at, bench, residual)
    parts = _errors(at, bench)
    bounds = np.cumsum([0] + [len(part) for part in parts])
    n, logs = at.problem.n, len(at.problem.fit)
    columns, left = [], []
    for k in range(n):
        rows = np.concatenate([np.arange(bounds[j * n + k], bounds[j * n + k + 1])
                               for j in range(logs)])
        used = [i for i in range(len(at.open)) if np.any(jacobian[rows, i])]
        prior = np.diag([at.open[i].size / at.open[i].tolerance if at.open[i].tolerance else 0.0
                         for i in used])
        columns.append(np.concatenate([jacobian[np.ix_(rows, used)], prior]))
        left.append(residual[rows])
    return columns, left


def bench_of(problem, base):
    """Return the bench for a base hypothesis: noises, and responses to an unknown start."""
    from clie_blocks.analysis.gap.noise import noise
    from clie_blocks.analysis.gap.sensitivity import sensor_sensitivity

    inertia, damping = base.values["inertia"], base.values["damping"]
    noises = tuple(noise(problem, k, sensor_sensitivity(problem.law, k, inertia[k], damping[k]))
                   for k in range(problem.n))
    response = functools.partial(_free_response, problem, inertia, damping)
    free = [[_orthonormal(white(decimated(response(k, len(log)), problem.period),
                                noises[k].whitener)) for k in range(problem.n)]
            for log in problem.logs]
    return Bench(problem, noises, free)


def _free_response(problem, inertia, damping, k, samples):
    """Responses of the measured position to a start elsewhere, and to a start in motion."""
    from scipy.signal import lfilter

    from clie_blocks.analysis.gap.sensitivity import sensor_sensitivity, torque_sensitivity

    kick = np.zeros(samples)
    kick[0] = 1.0
    b, a = torque_sensitivity(problem.law, k, inertia[k], damping[k])
    displaced = lfilter(*sensor_sensitivity(problem.law, k, inertia[k], damping[k]),
                        np.ones(samples))
    return np.stack([lfilter(b, a, kick), displaced], axis=1)


def _orthonormal(columns):
    return np.linalg.qr(columns / (np.sqrt((columns**2).sum(axis=0)) + 1e-300))[0]
