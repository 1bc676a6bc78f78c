"""The end of a fit: home to the datasheet, as far as the logs leave it open.

Where the logs tell two numbers only together, as a gain of the drive and the inertia, a fit ends
anywhere in the stretch that the tolerances allow.  What lies anywhere within its tolerance has a
mean, the stated value, and a variance, so that one more step ends where the numbers are expected.
What the logs tell, it leaves.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.slopes import Tangent, both_sides
from clie_blocks.analysis.gap.step import ANYWHERE, TINY, spread, step

WAYS = 2.0 ** -np.arange(7)  # shares of the step that are tried side by side
ROUNDS, NOTABLE = 3, 10.0  # steps; chi^2 beyond chance that one must gain for another to follow


def homed(found, bench):
    """Return a fit with its numbers where logs and datasheet expect them, and with their spread.

    Parameters
    ----------
    found : Fit
        A fit that has ended.
    bench : Bench
        Whitening.

    """
    for _ in range(ROUNDS):
        found, gained = _nearer(found, bench)
        if gained < NOTABLE:
            break
    return found


def _nearer(found, bench):
    """Fit after a step home, and what the step gained."""
    at, misfit = found.hypothesis, max(found.chi2.sum() / found.samples.sum(), 1.0)
    here = _doubted(both_sides(at, bench), misfit)
    goal = step(at, here, TINY, within=ANYWHERE)
    tried = [at, *(_between(at, goal, way) for way in WAYS)]
    chi2 = _chi2(tried, bench)
    rated = [_rated(one, each, misfit) for one, each in zip(tried, chi2)]
    best = int(np.argmin(rated))
    return dataclasses.replace(
        found, hypothesis=tried[best], chi2=chi2[best], stray=tried[best].stray(),
        spread=spread(at.open, here.normal[0], 1.0)), rated[0] - rated[best]


def _doubted(here, misfit):
    """Tangent that is as little sure as the model is good."""
    rows = np.where(np.arange(len(here.residual)) < len(here.slopes), 1 / np.sqrt(misfit), 1.0)
    return Tangent(here.parts, rows * here.residual, rows[:, None] * here.columns)


def _between(at, goal, way):
    """Hypothesis part of the way to another one."""
    return at.with_values(at.moved([
        (entry, (1.0 - way) * at.get(entry) + way * goal.get(entry)) for entry in at.open]))


def _chi2(tried, bench):
    """chi^2 of each log and joint, for some variants of a hypothesis."""
    at = tried[0]
    runs = [[(part**2).sum(axis=1) for part in bench.residuals(
        at.means(j, [one.values for one in tried]), j)]
        for j in range(len(at.problem.logs))]
    return np.moveaxis(np.array(runs), -1, 0)


def _rated(at, chi2, misfit):
    """What logs and datasheet have against a model, the smaller the better."""
    away = np.abs([(at.get(entry) - entry.centre) / entry.tolerance
                   for entry in at.open if entry.tolerance])
    stray = at.stray()
    return (chi2[:len(at.problem.fit)].sum() / misfit + stray @ stray
            + ANYWHERE * np.where(away < 1.0, away**2, 2.0 * away - 1.0).sum())
