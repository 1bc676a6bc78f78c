"""Least squares of a hypothesis in closed loop: simulate, whiten, step, keep what improves.

The residual is the whitened prediction error of all joints and fit logs, freed from the response
to an unknown start, with the distances from the datasheet appended.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.hypothesis import DIVERGED
from clie_blocks.analysis.gap.slopes import both_sides, linearised
from clie_blocks.analysis.gap.step import DAMPING, change, spread, step

CONVERGED = 1e-3
FUTILE = 0.1  # of the gain that ends a fit: foreseen to be less, a step is not simulated
TRIES = 4
LIGHT = 1e-6  # damping: a heavier one crawls where a cause and the joint model are alike
ASTRAY = 1.0  # squared sigmas beyond the datasheet from which on a fit looks twice
CAUTION = 10.0 ** np.arange(1.0, 7.0, 0.75)  # factors on a damping that failed


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
        Of the open numbers, from the Jacobian: what the logs and the datasheet's bounds tell.
    spread : ndarray, shape (open,)
        Standard deviation of the open numbers, see `spread` in `step`: what is told to the user.
    iterations : int
        Steps that were kept.

    """

    hypothesis: object
    chi2: np.ndarray
    samples: np.ndarray
    stray: np.ndarray
    covariance: np.ndarray
    spread: np.ndarray
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

    Where a fit ends beyond the datasheet it goes on with slopes taken to both sides: along a flat
    valley, the curvature in a slope to one side outweighs what draws it home.

    Parameters
    ----------
    start : Hypothesis
        With values to start from.
    bench : Bench
        Whitening and free responses.
    iterations : int
        Most steps.

    """
    at, damping, kept, turned, wary = start, LIGHT, 0, False, False
    here = linearised(at, bench)
    for _ in range(iterations):
        found = _better(at, here, bench, damping, wary)
        if found is not None:
            at, damping, wary = found
            kept += 1
        after = linearised(at, bench)
        ended = found is None or here.cost - after.cost < _little(after)
        if ended and (turned or at.stray() @ at.stray() < ASTRAY):
            break
        if ended:
            damping, turned = LIGHT, True
        here = both_sides(at, bench) if turned else after
    return _judged(at, bench, kept)


def _little(here):
    """Gain of a step that ends a fit."""
    return CONVERGED * len(here.residual) + 1e-4 * here.cost


def _better(at, here, bench, damping, wary):
    """Step that improves: ``hypothesis, next damping, wary``; None if there is none worth it.

    If the first step fails, many more cautious ones are simulated side by side.  The next first
    step is likely to fail as well: a wary fit tries it among them, and no slopes are taken there.
    """
    if foreseen(at, here) < FUTILE * _little(here):
        return None
    first = step(at, here, damping)
    if not wary and linearised(first, bench).cost < here.cost:
        return first, max(damping / 10, LIGHT), False
    dampings = max(damping, DAMPING) * CAUTION
    proposals = [step(at, here, more) for more in dampings]
    costs = _costs([first, *proposals] if wary else proposals, bench)
    if wary and costs[0] < here.cost:
        return first, max(damping / 10, LIGHT), False
    costs = costs[-len(proposals):]
    best = int(np.argmin(costs))
    return (proposals[best], dampings[best] / 10, True) if costs[best] < here.cost else None


def foreseen(at, here):
    """Gain that the slopes of a hypothesis promise, were its numbers free to take any step."""
    delta, (gram, right) = change(at.open, at, *here.normal, LIGHT), here.normal
    stray = [entry.stray(at.get(entry) + moved * entry.size)
             for entry, moved in zip(at.open, delta)]
    before = here.residual[len(here.residual) - len(at.open):]
    return -delta @ (2 * right + gram @ delta) + before @ before - np.dot(stray, stray)


def _costs(proposals, bench):
    """Cost of each of some variants of a hypothesis, simulated side by side."""
    at = proposals[0]
    costs = [proposal.stray() @ proposal.stray() for proposal in proposals]
    for j in range(len(at.problem.fit)):
        for part in bench.residuals(at.means(j, [each.values for each in proposals]), j):
            costs = costs + (part**2).sum(axis=1)
    return costs


def shrunk(start, bench, reference, members):
    """Return a start with smaller amplitudes, if as it is it does worse than a reference.

    Parameters
    ----------
    start : Hypothesis
        With numbers from a linear regression, which may reach too far.
    bench : Bench
        Whitening.
    reference : float
        Cost on the fit logs of the hypothesis without the causes.
    members : sequence of Member
        Whose amplitudes.

    """
    amplitudes = [f"{member.name}.{number.name}" for member in members
                  for number in member.cause.numbers
                  if number.neutral == 0.0 and not number.fixed]
    for _ in range(TRIES):
        if linearised(start, bench).cost < reference:
            break
        start = start.with_values({key: 0.3 * value if key in amplitudes else value
                                   for key, value in start.values.items()})
    return start


def _judged(at, bench, kept):
    """Fit of a hypothesis as it stands."""
    here, n, logs = linearised(at, bench), at.problem.n, len(at.problem.logs)
    held_out = [part[0] for j in range(len(at.problem.fit), logs)
                for part in bench.residuals(at.means(j, [at.values]), j)]
    parts = [*here.parts, *held_out]
    chi2 = np.reshape([part @ part for part in parts], (logs, n))
    samples = np.reshape([float(len(part)) for part in parts], (logs, n))
    covariance = np.linalg.pinv(here.columns.T @ here.columns, hermitian=True)
    scale = np.array([entry.size for entry in at.open])
    misfit = chi2.sum() / samples.sum()
    return Fit(at, chi2, samples, at.stray(), covariance * np.outer(scale, scale),
               spread(at.open, here.normal[0], misfit), kept)


def diverged(found):
    """Whether the model of a fit leaves every bound in one of the logs."""
    at = found.hypothesis
    return any(np.abs(at.error(j)).max() >= DIVERGED for j in range(len(at.problem.logs)))
