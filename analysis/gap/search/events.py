"""Causes that come with time are searched, not gridded: a frequency, and the moment of a fault.

Both are torques that do not depend on the model's own motion, so their effect on the error is
their sensitivity-filtered course, and whole families of them are scanned at once.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, has_diverged
from clie_blocks.analysis.gap.problem.planar_chain import tip_load_torque
from clie_blocks.analysis.gap.residual.noise import RATE, decimated, decimation, whiten
from clie_blocks.analysis.gap.residual.sensitivity import decimated_filter, torque_sensitivity
from clie_blocks.linear_filters import lfilter

PADDED = 1 << 16
ONSET_SPACING = 1.0  # s between the moments that are tried first
ONSET_FINE = 0.04, 4e-3  # s, then, for the kinds of fault that do best
LEADING = 0.3  # of the best kind's drop
EDGE = 1.0  # s at both ends of a log where no fault is looked for
NEVER = 1e9


def whitened_errors(bench, base):
    """Whitened errors of the base in all logs: ``[log][joint]``."""
    return [bench.whitened(base.hypothesis.error(j), j)
            for j in range(len(bench.problem.logs))]


def torque_columns(bench, base, j, k, torque):
    """Whitened response of joint k in log j to courses of torque that oppose, (N, m)."""
    values = base.hypothesis.values
    b, a = torque_sensitivity(bench.problem.law, k, values["inertia"][k], values["damping"][k])
    moved = decimated(-lfilter(b, a, torque), bench.problem.period)
    return bench.projected(whiten(moved, bench.noises[k].whitener), j, k)


def periodic_candidates(bench, base, errors, causes):
    """Return the member of the strongest sinusoid of each joint, and what it would explain.

    Returns
    -------
    list of (Member, ndarray)
        Periodic disturbance at all joints, and the drop of chi^2 on the fit logs per joint;
        empty if it is not among the causes to look for.

    """
    if PERIODIC_DISTURBANCE not in causes:
        return []
    problem = bench.problem
    fit, n = len(problem.fit), problem.n
    values = {name: np.zeros((len(problem.logs), n)) for name in ("sine", "cosine")}
    frequency, drop = np.ones(n), np.zeros(n)
    grid = np.fft.rfftfreq(PADDED, 1.0 / RATE)
    band = (grid > 0.06) & (grid < 0.4 * RATE)
    for k in range(n):
        power = sum(np.abs(np.fft.rfft(errors[j][k], PADDED)) ** 2 * 2 / len(errors[j][k])
                    for j in range(fit))
        frequency[k] = grid[band][np.argmax(power[band])]
        for j, log in enumerate(problem.logs):
            phase = 2 * np.pi * frequency[k] * problem.period * np.arange(len(log))
            data = torque_columns(bench, base, j, k, np.stack([np.sin(phase), np.cos(phase)], 1))
            theta = np.linalg.lstsq(data, errors[j][k], rcond=None)[0]
            values["sine"][j, k], values["cosine"][j, k] = theta
            if j < fit:
                drop[k] += float(errors[j][k] @ data @ theta)
    size = np.max(np.abs([values["sine"], values["cosine"]]), axis=(0, 1)) + 1e-12
    sizes = {"sine": size, "cosine": size, "frequency": 0.01 + 0 * frequency}
    return [(Member(PERIODIC_DISTURBANCE, tuple(range(n)),
                    {**values, "frequency": frequency}, sizes), drop)]


def fault_candidates(bench, base, errors, causes):
    """Return a member for each kind of fault that sets in, and what it would explain.

    Returns
    -------
    list of (Member, ndarray)
        As in `periodic`; the moment may differ between logs, the size does not.

    """
    problem, at = bench.problem, base.hypothesis
    motion = [at.positions(j, [at.values])[0].T for j in range(len(problem.logs))]
    found = []
    for cause in STEP_FAULT:
        if cause in causes and (problem.chain.known or not cause.needs_links):
            courses = [unit_fault_torque(cause.variant, problem, q) for q in motion]
            moments = [[np.arange(EDGE, len(log) * problem.period - EDGE, ONSET_SPACING)
                        for log in problem.logs] for _ in range(problem.n)]
            found.append((courses, *_fault(bench, base, errors, cause, courses, moments)))
    best = max((drop.sum() for _, _, drop in found), default=0.0)
    return [_refine_moments(bench, base, errors, *one) if one[2].sum() >= LEADING * best else one[1:]
            for one in found]


def _refine_moments(bench, base, errors, courses, member, drop):
    """The same fault with its moments found more and more finely."""
    for wide, fine in zip((ONSET_SPACING, *ONSET_FINE), ONSET_FINE):
        moments = [[np.arange(at - wide, at + wide, fine) if at < NEVER else np.array([EDGE])
                    for at in member.values["onset"][:, k]] for k in range(bench.problem.n)]
        member, drop = _fault(bench, base, errors, member.cause, courses, moments)
    return member, drop


def _fault(bench, base, errors, cause, courses, moments):
    """Best size and moments of one kind of fault among some moments, per joint and log."""
    problem, n = bench.problem, bench.problem.n
    size, onset, drop = np.zeros(n), np.full((len(problem.logs), n), NEVER), np.zeros(n)
    for joints in ([list(range(n))] if cause.shared else [[k] for k in range(n)]):
        tried = moments[joints[0]]
        scans = _scans(bench, base, errors, courses, joints, tried)
        best, at, gained = _common_size(scans, len(problem.fit))
        size[joints], drop[joints] = best, gained / len(joints)
        for j, where in enumerate(at):
            if where is not None:
                onset[j, joints] = tried[j][where]
    return Member(cause, tuple(range(n)), {cause.numbers[0].name: size, "onset": onset},
                  {cause.numbers[0].name: np.abs(size) + 1e-9}), drop


def _scans(bench, base, errors, courses, joints, moments):
    """Per log, projections of the joints' errors on the fault from each moment on."""
    return [[sum(parts) for parts in zip(*(
        onset_projections(bench, base, errors[j][k], j, k, courses[j][:, k], tried) for k in joints))]
        for j, tried in enumerate(moments)]


def unit_fault_torque(variant, problem, q):
    """Torque of a unit fault that lasts the whole log, (N, n)."""
    if variant == "torque":
        return np.ones_like(q)
    dq = np.gradient(q, problem.period, axis=0)
    if variant == "damping":
        return dq
    if variant == "friction":
        return np.sign(dq)
    ddq = np.gradient(dq, problem.period, axis=0)
    return tip_load_torque(problem.chain, q, dq, ddq) / problem.gear_ratio


def onset_projections(bench, base, error, j, k, course, moments):
    """Projections of an error on the fault from each moment on: its product and its square."""
    problem, values = bench.problem, base.hypothesis.values
    width = decimation(problem.period)
    torque = decimated(course, problem.period)[:, None]
    ends = np.arange(1, len(torque) + 1)[:, None]
    left = np.clip(ends - moments / (width * problem.period), 0.0, 1.0)  # of the block
    b, a = decimated_filter(*torque_sensitivity(problem.law, k, values["inertia"][k], values["damping"][k]),
                  width)
    data = bench.projected(whiten(-lfilter(b, a, left * torque),
                                 bench.noises[k].whitener), j, k)
    return data.T @ error, (data**2).sum(axis=0)


def _common_size(scans, fit):
    """Size that serves all fit logs, the best moment of each log (None: never), and the drop."""
    first = [int(np.argmax(right**2 / (square + 1e-12))) for right, square in scans[:fit]]
    tops = [right[i] / (square[i] + 1e-12) for (right, square), i in zip(scans, first)]
    best = (0.0, 0.0, [None] * len(scans))
    for size in tops:
        for _ in range(3):
            gains = [2 * size * right - size**2 * square for right, square in scans]
            at = [int(np.argmax(g)) if g.max() > 0 else None for g in gains]
            pairs = [(scans[j][0][at[j]], scans[j][1][at[j]]) for j in range(fit)
                     if at[j] is not None]
            if not pairs:
                break
            size = sum(right for right, _ in pairs) / sum(square for _, square in pairs)
        drop = sum(gains[j][at[j]] for j in range(fit) if at[j] is not None)
        if drop > best[0]:
            best = (drop, size, at)
    return best[1], best[2], best[0]


REFIT_SPACING = 0.2  # s between the moments of a fault that are tried in the whole log
REFIT_FINE = 0.02, 4e-3  # s, then around the best of them
REACHES = 0.5, 0.07, 0.01  # s around a moment that are simulated, as friction that sticks needs
SIDE_BY_SIDE = 15  # simulations
CHANCE = 20.0  # chi^2 that the best of a thousand moments may gain in a log without the fault
STEPS = 4  # of the fit that follows
ROUNDS = 3
GAIN = 0.01  # share of chi^2 that a round must remove for another one


def refit_event_times(found, bench):
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
    if not timed or has_diverged(found):
        return found
    for _ in range(ROUNDS):
        at = found.hypothesis
        for member in timed:
            again = refit_phases if member.cause is PERIODIC_DISTURBANCE else refit_onsets
            at = at.with_values(again(dataclasses.replace(found, hypothesis=at), member, bench))
        before, tried = found.total, fit(at, bench, STEPS)
        found = tried if tried.total < before else found
        if found.total > (1.0 - GAIN) * before:
            break
    return found


def refit_phases(found, member, bench):
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


def refit_onsets(found, member, bench):
    """Values with the moment of a fault at which it explains most of each log."""
    at, problem = found.hypothesis, bench.problem
    onset, size = (f"{member.name}.{name}" for name in ("onset", member.cause.numbers[0].name))
    moments = at.values[onset].copy()
    without = at.with_values({**at.values, onset: np.full_like(moments, NEVER)})
    for j, log in enumerate(problem.logs):
        error = without.error(j)
        errors = bench.whitened(error, j)
        torque = unit_fault_torque(member.cause.variant, problem, log.q - error)
        for joints in [list(member.joints)] if member.cause.shared else [[k] for k in
                                                                         member.joints]:
            large, known = at.values[size][joints[0]], moments[j, joints[0]] < NEVER
            tried = np.arange(EDGE, len(torque) * problem.period - EDGE, REFIT_SPACING)
            if known:
                tried = np.append(tried, moments[j, joints[0]])
            parts = [(errors[k], j, k, torque[:, k]) for k in joints]
            moment, gain = _best(functools.partial(_gains, bench, found, parts, large), tried)
            if known or gain > CHANCE:
                moments[j, joints] = _simulated_onset(at, bench, onset, moment, j, joints)
    return {**at.values, onset: moments}


def _gains(bench, found, parts, large, tried):
    """What a fault of a given size would explain of the joints' errors, set in at each moment."""
    right, square = (sum(column) for column in zip(*(
        onset_projections(bench, found, *part, tried) for part in parts)))
    return 2 * large * right - large**2 * square


def _best(gains, tried):
    """Moment that gains most, found more and more finely, and what it gains."""
    for wide, fine in zip((REFIT_SPACING, *REFIT_FINE), REFIT_FINE):
        moment = tried[np.argmax(gains(tried))]
        tried = moment + np.arange(-wide, wide, fine)
    found = gains(tried)
    return tried[np.argmax(found)], found.max()


def _simulated_onset(at, bench, onset, moment, j, joints):
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
