"""Least squares of a hypothesis in closed loop: simulate, whiten, step, keep what improves.

The residual is the whitened prediction error of all joints and fit logs, freed from the response
to an unknown start, with the distances from the datasheet appended.  Columns of the Jacobian are
finite differences of simulations; numbers that act on different rows, of other logs or of joints
that do not push each other, are moved in one run.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.hypothesis import DIVERGED, SOFTNESS
from clie_blocks.analysis.gap.step import DAMPING, change, spread, step

CONVERGED = 1e-3
FUTILE = 0.1  # of the gain that ends a fit: foreseen to be less, a step is not simulated
TRIES = 4
LIGHT = 1e-6  # damping: a heavier one crawls where a cause and the joint model are alike
ASIDE = 5e-3  # of a number's size: wider, curvature hides the slope of a flat valley, and a fit
# crawls; narrower, the instants at which friction holds and teeth meet hide it
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


@dataclasses.dataclass(frozen=True, eq=False)
class Tangent:
    """What a small step on each open number of a hypothesis would change.

    Parameters
    ----------
    parts : list of ndarray
        Whitened residual of each joint, log by log.
    residual : ndarray
        All parts, with the distances from the datasheet below.
    columns : ndarray
        Derivatives of the residual to (value / size) of each open number.

    """

    parts: list
    residual: np.ndarray
    columns: np.ndarray

    @functools.cached_property
    def cost(self):
        """Sum of squares."""
        return float(self.residual @ self.residual)

    @property
    def slopes(self):
        """Columns of the logs, without the datasheet."""
        return self.columns[:len(self.residual) - self.columns.shape[1]]

    @functools.cached_property
    def normal(self):
        """Matrix and right-hand side of the normal equations, without the datasheet."""
        columns = self.slopes
        return columns.T @ columns, columns.T @ self.residual[:len(columns)]


def linearised(at, bench):
    """Return the `Tangent` of a hypothesis; a second question costs nothing."""
    if at not in bench.tangents:
        bench.tangents[at] = sloped(at, bench)
    return bench.tangents[at]


def sloped(at, bench, width=ASIDE):
    """Return a `Tangent` whose slopes are taken over some share of each number's size.

    Parameters
    ----------
    at : Hypothesis
        Where.
    bench : Bench
        Whitening.
    width : float
        Share of the size; negative for slopes to the other side.

    """
    groups = [[(i, *_difference(at, at.open[i], width)) for i in group] for group in _groups(at)]
    sets = [at.values, *(at.moved([(at.open[i], value) for i, value, _ in group])
                         for group in groups)]
    runs = [part for j in range(len(at.problem.fit))
            for part in bench.residuals(at.means(j, sets), j)]
    parts, stray = [run[0] for run in runs], at.stray()
    residual = np.concatenate([*parts, stray])
    columns, last = np.zeros((len(residual), len(at.open))), 0
    for place, run in enumerate(runs):
        rows = slice(last, last + run.shape[1])
        last = rows.stop
        where = divmod(place, at.problem.n)
        for group, moved in zip(groups, run[1:]):
            for i, _, width in group:
                if _acts(at, at.open[i], *where):
                    columns[rows, i] = (moved - run[0]) / width
    for i, entry in enumerate(at.open):
        if entry.tolerance is not None and stray[i] != 0.0:
            columns[last + i, i] = entry.size / entry.tolerance / SOFTNESS
    return Tangent(parts, residual, columns)


def both_sides(at, bench):
    """Return the `Tangent` of a hypothesis by central differences.

    A slope to one side holds half the curvature, and passes it for a difference between numbers
    that are alike.
    """
    ahead, behind = linearised(at, bench), sloped(at, bench, -ASIDE)
    return dataclasses.replace(ahead, columns=(ahead.columns + behind.columns) / 2)


def _acts(at, entry, log, joint):
    return entry.log in (None, log) and (at.coupled or entry.joint in (None, joint))


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
    at, damping, kept, turned = start, LIGHT, 0, False
    here = linearised(at, bench)
    for _ in range(iterations):
        found = _better(at, here, bench, damping)
        if found is not None:
            at, damping = found
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


def _better(at, here, bench, damping):
    """Step that improves: ``hypothesis, next damping``; None if there is none worth it.

    If the first step fails, many more cautious ones are simulated side by side.
    """
    if _foreseen(at, here) < FUTILE * _little(here):
        return None
    first = step(at, here, damping)
    if linearised(first, bench).cost < here.cost:
        return first, max(damping / 10, LIGHT)
    dampings = max(damping, DAMPING) * CAUTION
    proposals = [step(at, here, more) for more in dampings]
    costs = _costs(proposals, bench)
    best = int(np.argmin(costs))
    return (proposals[best], dampings[best] / 10) if costs[best] < here.cost else None


def _foreseen(at, here):
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


def _groups(at):
    """Open numbers that may move in the same run: one key, and each acts on rows of its own."""
    groups = {}
    for i, entry in enumerate(at.open):
        groups.setdefault((entry.key, at.coupled and entry.joint), []).append(i)
    return groups.values()


def _difference(at, entry, width):
    """Value a small step away, inside the bounds, and the step in units of the entry's size."""
    here = at.get(entry)
    step = width * (entry.size if entry.phase else max(entry.size, 0.2 * abs(here)))
    if not entry.lower <= here + step <= entry.upper:
        step = -step
    return here + step, step / entry.size


def tangent(found, bench):
    """Per joint, columns of a fit's numbers and its residual, on the fit logs, with their prior.

    Returns
    -------
    columns, residual : list of ndarray
        One of each per joint.  Below the rows of the logs both carry one row per number: what the
        datasheet allows, and how far beyond it the number stands, counted at its own joint.  A
        number that does not act on the joint is left out.

    """
    at = found.hypothesis
    here = linearised(at, bench)
    n = at.problem.n
    ends = np.cumsum([0, *(len(part) for part in here.parts)])
    columns, residual = [], []
    for k in range(n):
        rows = np.concatenate([np.arange(ends[place], ends[place + 1])
                               for place in range(k, len(here.parts), n)])
        used = [i for i in range(len(at.open)) if np.any(here.columns[rows, i])]
        slopes, stray = np.reshape([_prior(at.open[i], found.stray[i], k) for i in used],
                                   (-1, 2)).T
        columns.append(np.concatenate([here.columns[np.ix_(rows, used)], np.diag(slopes)]))
        residual.append(np.concatenate([*here.parts[k::n], stray]))
    return columns, residual


def _prior(entry, stray, k):
    """Slope and value of a number's distance from the datasheet, as joint k counts it [sigma]."""
    if not entry.tolerance:
        return 0.0, 0.0
    if stray == 0.0 or entry.joint != k:
        return entry.size / entry.tolerance, 0.0
    return entry.size / entry.tolerance / SOFTNESS, stray
