"""Slopes of a hypothesis: what a small step on each of its numbers changes in the residual.

Columns of the Jacobian are finite differences of simulations; numbers that act on different rows,
of other logs or of joints that do not push each other, are moved in one run.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import SOFTNESS

ASIDE = 5e-3  # of a number's size: wider, curvature hides the slope of a flat valley, and a fit
# crawls; narrower, the instants at which friction holds and teeth meet hide it
ROOM = 400_000_000  # bytes of slopes that are kept: those of arms of six joints fill gigabytes


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


def jacobian(at, bench):
    """Return the `Tangent` of a hypothesis; a second question costs nothing, unless long after."""
    kept = bench.tangents
    if at not in kept:
        kept[at] = found = forward_jacobian(at, bench)
        while len(kept) > 1 and sum(each.columns.nbytes for each in kept.values()) > ROOM:
            del kept[next(iter(kept))]
        return found
    return kept[at]


def forward_jacobian(at, bench, width=ASIDE):
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


def central_jacobian(at, bench):
    """Return the `Tangent` of a hypothesis by central differences.

    A slope to one side holds half the curvature, and passes it for a difference between numbers
    that are alike.
    """
    ahead, behind = jacobian(at, bench), forward_jacobian(at, bench, -ASIDE)
    return dataclasses.replace(ahead, columns=(ahead.columns + behind.columns) / 2)


def _acts(at, entry, log, joint):
    return entry.log in (None, log) and (at.coupled or entry.joint in (None, joint))


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


def joint_columns(found, bench):
    """Per joint, columns of a fit's numbers and its residual, on the fit logs, with their prior.

    Returns
    -------
    columns, residual : list of ndarray
        One of each per joint.  Below the rows of the logs both carry one row per number: what the
        datasheet allows, and how far beyond it the number stands, counted at its own joint.  A
        number that does not act on the joint is left out.

    """
    at = found.hypothesis
    here = jacobian(at, bench)
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
