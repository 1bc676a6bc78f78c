"""The end of a fit: home to the datasheet, as far as the logs leave it open.

Where the logs tell two numbers only together, as a gain of the drive and the inertia, a fit ends
anywhere in the stretch that the tolerances allow.  What lies anywhere within its tolerance has a
mean, the stated value, and a variance, so that one more step ends where the numbers are expected.
What the logs tell, it leaves.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.jacobian import Tangent, central_jacobian, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import (
    ANYWHERE,
    TINY,
    damped_step,
    excess,
    fit,
    predicted_gain,
    standard_deviations,
)

WAYS = 2.0 ** -np.arange(7)  # shares of the step that are tried side by side
ROUNDS, NOTABLE = 3, 10.0  # steps; chi^2 beyond chance that one must gain for another to follow


def refine_to_prior(found, bench):
    """Return a fit with its numbers where logs and datasheet expect them, and with their spread.

    Parameters
    ----------
    found : Fit
        A fit that has ended.
    bench : Bench
        Whitening.

    """
    for _ in range(ROUNDS):
        found, gained = _nearer_to_prior(found, bench)
        if gained < NOTABLE:
            break
    return found


def _nearer_to_prior(found, bench):
    """Fit after a step home, and what the step gained."""
    at, misfit = found.hypothesis, max(found.chi2.sum() / found.samples.sum(), 1.0)
    here = _with_uncertainty(central_jacobian(at, bench), misfit)
    goal = damped_step(at, here, TINY, within=ANYWHERE)
    tried = [at, *(_between(at, goal, way) for way in WAYS)]
    chi2 = _chi2(tried, bench)
    rated = [_with_cost(one, each, misfit) for one, each in zip(tried, chi2)]
    best = int(np.argmin(rated))
    return dataclasses.replace(
        found, hypothesis=tried[best], chi2=chi2[best], stray=tried[best].stray(),
        spread=standard_deviations(at.open, here.normal[0], 1.0)), rated[0] - rated[best]


def _with_uncertainty(here, misfit):
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


def _with_cost(at, chi2, misfit):
    """What logs and datasheet have against a model, the smaller the better."""
    away = np.abs([(at.get(entry) - entry.centre) / entry.tolerance
                   for entry in at.open if entry.tolerance])
    stray = at.stray()
    return (chi2[:len(at.problem.fit)].sum() / misfit + stray @ stray
            + ANYWHERE * np.where(away < 1.0, away**2, 2.0 * away - 1.0).sum())


USELESS, USELESS_SHARE = 0.05, 0.002  # rise of the excess that a joint left out may cause
CLEAR = 10.0  # times that rise foreseen: then no fit need show it
SURE = 3.0  # times that rise promised without the joint: then no fit need show it either
NEAR = 0.01  # share of the whole excess that a fit may leave for its slopes to be believed


def prune_joints(found, bench, nothing):
    """Leave out joints at which a cause of a fit does no more than noise.

    Parameters
    ----------
    found : Fit
        A fitted hypothesis.
    bench : Bench
        Whitening.
    nothing : float
        Excess of the refitted nominal model.

    """
    if found not in bench.freed:
        freed = _without_idle_joints(found, bench, nothing)
        bench.freed[found] = bench.freed[freed] = freed
    return bench.freed[found]


def _without_idle_joints(found, bench, nothing):
    for place, member in enumerate(found.hypothesis.members):
        if member.cause.shared or len(member.joints) == 1:
            continue
        rise = USELESS + USELESS_SHARE * nothing
        near = excess(found) < USELESS + NEAR * nothing
        foreseen = {k: _predicted(found, place, k) for k in member.joints}
        idle = [k for k in foreseen if foreseen[k] < rise]
        if near and 1 < len(idle) < len(foreseen):
            found = _refitted(found, place, idle, bench, rise * len(idle))
        for k in found.hypothesis.members[place].joints:
            if not near or foreseen[k] < CLEAR * rise:
                found = _refitted(found, place, [k], bench, rise)
    return found


def _refitted(found, place, joints, bench, rise):
    """Fit with a cause left out at some joints, if the excess rises by less; else the same."""
    fewer = _without(found.hypothesis, place, joints)
    if fewer is None or _predicted_cost(fewer, found, bench) > SURE * rise:
        return found
    tried = fit(fewer, bench, 3)
    return tried if excess(tried) - excess(found) < rise else found


def _predicted_cost(fewer, found, bench):
    """Rise of the excess on the fit logs that the slopes of a start promise to its fit."""
    here, samples = jacobian(fewer, bench), found.samples[:len(fewer.problem.fit)]
    left = here.cost - predicted_gain(fewer, here)
    return (left - found.cost) / (samples.sum() / fewer.problem.n)


def _predicted(found, place, k):
    """Rise of the excess that the slopes of a fit foresee where a joint loses a cause."""
    at = found.hypothesis
    member = at.members[place]
    neutral = {f"{member.name}.{number.name}": number.neutral for number in member.cause.numbers
               if number.neutral is not None}
    mine = [i for i, entry in enumerate(at.open) if entry.key in neutral and entry.joint == k]
    away = np.array([at.get(at.open[i]) - neutral[at.open[i].key] for i in mine])
    known = np.linalg.pinv(found.covariance[np.ix_(mine, mine)], hermitian=True)
    return away @ known @ away / (found.samples.sum() / at.problem.n)


def _without(at, place, left_out):
    member = at.members[place]
    joints = tuple(k for k in member.joints if k not in left_out)
    if not joints:
        return None
    values = dict(at.values)
    for number in member.cause.numbers:
        key = f"{member.name}.{number.name}"
        if number.neutral is not None:
            values[key] = values[key].copy()
            values[key][..., list(left_out)] = number.neutral
    members = list(at.members)
    members[place] = dataclasses.replace(member, joints=joints)
    return dataclasses.replace(at, members=tuple(members), values=values)
