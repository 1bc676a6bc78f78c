"""Causes that come with time are searched, not gridded: a frequency, and the moment of a fault.

Both are torques that do not depend on the model's own motion, so their effect on the error is
their sensitivity-filtered course, and whole families of them are scanned at once.
"""

import numpy as np

from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.hypothesis import Member
from clie_blocks.analysis.gap.links import tip_load_torque
from clie_blocks.analysis.gap.noise import RATE, decimated, decimation, white
from clie_blocks.analysis.gap.sensitivity import slowed, torque_sensitivity
from clie_blocks.compiled.recursion import lfilter

PADDED = 1 << 16
SPACING = 1.0  # s between the moments that are tried first
FINE = 0.04, 4e-3  # s, then, for the kinds of fault that do best
LEADING = 0.3  # of the best kind's drop
EDGE = 1.0  # s at both ends of a log where no fault is looked for
NEVER = 1e9


def residuals(bench, base):
    """Whitened errors of the base in all logs: ``[log][joint]``."""
    return [bench.whitened(base.hypothesis.error(j), j)
            for j in range(len(bench.problem.logs))]


def torque_columns(bench, base, j, k, torque):
    """Whitened response of joint k in log j to courses of torque that oppose, (N, m)."""
    values = base.hypothesis.values
    b, a = torque_sensitivity(bench.problem.law, k, values["inertia"][k], values["damping"][k])
    moved = decimated(-lfilter(b, a, torque), bench.problem.period)
    return bench.projected(white(moved, bench.noises[k].whitener), j, k)


def periodic(bench, base, errors, causes):
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


def faults(bench, base, errors, causes):
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
            courses = [course(cause.variant, problem, q) for q in motion]
            moments = [[np.arange(EDGE, len(log) * problem.period - EDGE, SPACING)
                        for log in problem.logs] for _ in range(problem.n)]
            found.append((courses, *_fault(bench, base, errors, cause, courses, moments)))
    best = max((drop.sum() for _, _, drop in found), default=0.0)
    return [_refined(bench, base, errors, *one) if one[2].sum() >= LEADING * best else one[1:]
            for one in found]


def _refined(bench, base, errors, courses, member, drop):
    """The same fault with its moments found more and more finely."""
    for wide, fine in zip((SPACING, *FINE), FINE):
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
        scan(bench, base, errors[j][k], j, k, courses[j][:, k], tried) for k in joints))]
        for j, tried in enumerate(moments)]


def course(variant, problem, q):
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


def scan(bench, base, error, j, k, course, moments):
    """Projections of an error on the fault from each moment on: its product and its square."""
    problem, values = bench.problem, base.hypothesis.values
    width = decimation(problem.period)
    torque = decimated(course, problem.period)[:, None]
    ends = np.arange(1, len(torque) + 1)[:, None]
    left = np.clip(ends - moments / (width * problem.period), 0.0, 1.0)  # of the block
    b, a = slowed(*torque_sensitivity(problem.law, k, values["inertia"][k], values["damping"][k]),
                  width)
    data = bench.projected(white(-lfilter(b, a, left * torque),
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
