"""What time brings differs from log to log: phase of a sinusoid, and moment of a fault.

They say nothing of the cause, so they are found anew in every log, held-out ones too, once the
rest of a hypothesis is fitted.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.fit import diverged, fit
from clie_blocks.analysis.gap.search import EDGE, NEVER, course, scan, torque_columns

SPACING = 0.2  # s between the moments of a fault that are tried in the whole log
FINE = 0.02, 4e-3  # s, then around the best of them
REACHES = 0.5, 0.07, 0.01  # s around a moment that are simulated, as friction that sticks needs
SIDE_BY_SIDE = 15  # simulations
CHANCE = 20.0  # chi^2 that the best of a thousand moments may gain in a log without the fault
STEPS = 4  # of the fit that follows
ROUNDS = 3
GAIN = 0.01  # share of chi^2 that a round must remove for another one


def settled(found, bench):
    """Return a fit with phases and moments of all logs found anew, if that explains more.

    Parameters
    ----------
    found : Fit
        A fitted hypothesis.
    bench : Bench
        Whitening.

    """
    timed = [member for member in found.hypothesis.members
             if member.cause is PERIODIC_DISTURBANCE or member.cause in STEP_FAULT]
    if not timed or diverged(found):
        return found
    for _ in range(ROUNDS):
        at = found.hypothesis
        for member in timed:
            again = rephased if member.cause is PERIODIC_DISTURBANCE else retimed
            at = at.with_values(again(dataclasses.replace(found, hypothesis=at), member, bench))
        before, tried = found.total, fit(at, bench, STEPS)
        found = tried if tried.total < before else found
        if found.total > (1.0 - GAIN) * before:
            break
    return found


def rephased(found, member, bench):
    """Values with sine and cosine of a sinusoid as they fit each log."""
    at, problem = found.hypothesis, bench.problem
    sine, cosine, frequency = (f"{member.name}.{name}" for name in ("sine", "cosine", "frequency"))
    values = {**at.values, sine: at.values[sine].copy(), cosine: at.values[cosine].copy()}
    for j, log in enumerate(problem.logs):
        errors = bench.whitened(at.error(j), j)
        for k in member.joints:
            phase = (2 * np.pi * at.values[frequency][k] * problem.period
                     * np.arange(len(log)))
            data = torque_columns(bench, found, j, k, np.stack([np.sin(phase), np.cos(phase)], 1))
            more = np.linalg.lstsq(data, errors[k], rcond=None)[0]
            values[sine][j, k] += more[0]
            values[cosine][j, k] += more[1]
    return values


def retimed(found, member, bench):
    """Values with the moment of a fault at which it explains most of each log."""
    at, problem = found.hypothesis, bench.problem
    onset, size = (f"{member.name}.{name}" for name in ("onset", member.cause.numbers[0].name))
    moments = at.values[onset].copy()
    without = at.with_values({**at.values, onset: np.full_like(moments, NEVER)})
    for j, log in enumerate(problem.logs):
        error = without.error(j)
        errors = bench.whitened(error, j)
        torque = course(member.cause.variant, problem, log.q - error)
        for joints in [list(member.joints)] if member.cause.shared else [[k] for k in
                                                                         member.joints]:
            large, known = at.values[size][joints[0]], moments[j, joints[0]] < NEVER
            tried = np.arange(EDGE, len(torque) * problem.period - EDGE, SPACING)
            if known:
                tried = np.append(tried, moments[j, joints[0]])
            parts = [(errors[k], j, k, torque[:, k]) for k in joints]
            moment, gain = _best(functools.partial(_gains, bench, found, parts, large), tried)
            if known or gain > CHANCE:
                moments[j, joints] = _simulated(at, bench, onset, moment, j, joints)
    return {**at.values, onset: moments}


def _gains(bench, found, parts, large, tried):
    """What a fault of a given size would explain of the joints' errors, set in at each moment."""
    right, square = (sum(column) for column in zip(*(
        scan(bench, found, *part, tried) for part in parts)))
    return 2 * large * right - large**2 * square


def _best(gains, tried):
    """Moment that gains most, found more and more finely, and what it gains."""
    for wide, fine in zip((SPACING, *FINE), FINE):
        moment = tried[np.argmax(gains(tried))]
        tried = moment + np.arange(-wide, wide, fine)
    found = gains(tried)
    return tried[np.argmax(found)], found.max()


def _simulated(at, bench, onset, moment, j, joints):
    """Moment in one log near another one at which the simulated fault leaves least."""
    for reach in REACHES:
        tried = np.maximum(moment + reach * np.linspace(-1.0, 1.0, SIDE_BY_SIDE), EDGE)
        sets = []
        for one in tried:
            moments = at.values[onset].copy()
            moments[j, joints] = one
            sets.append({**at.values, onset: moments})
        left = sum((part**2).sum(axis=1) for part in bench.residuals(at.means(j, sets), j))
        moment = tried[np.argmin(left)]
    return moment
