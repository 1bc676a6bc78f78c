"""Textbook inverse-dynamics least squares, with BIC over sets of regressors.

Positions are smoothed without phase and differentiated, torque and regressors pass the same
8 Hz filter, are thinned to its bandwidth, and one linear regression per joint follows.  The
regressors are the opposing torques of the vocabulary that the measured motion determines; what
needs a state, a delay or the inside of the drive is out of reach of this method.
"""

import itertools

import numpy as np

from clie_blocks.analysis.blind.comparison.baselines import smoothed_motion
from clie_blocks.analysis.blind.comparison.baselines.model_selection import Model, answer, bic
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.hypothesis import Member

LEADERS = 6  # causes that enter the search over pairs


def inverse_dynamics(problem):
    """Diagnose a robot by regression of its torque on the measured motion."""
    found = smoothed_motion.motions(problem, problem.fit)
    target = smoothed_motion.filtered(problem, [smoothed_motion.net_command(m) for m in found])
    base = base_columns(problem, found)
    plain = regressed(problem, target, base, ())
    single = [alone(problem, target, base, looks) for looks in probes(problem, found).values()]
    single.sort(key=lambda one: one[0].bic)
    pairs = [regressed(problem, target, base, (one, two)) for (_, one), (_, two)
             in itertools.combinations(single[:LEADERS], 2)]
    return answer(problem, [plain, *(model for model, _ in single), *pairs])


def alone(problem, target, base, looks):
    """Model of one cause in the shape that does best, and that entry of `probes`."""
    tried = [(regressed(problem, target, base, (look,)), look) for look in looks]
    return min(tried, key=lambda one: one[0].bic)


def base_columns(problem, found):
    """Filtered acceleration, velocity and one, shape (3, N, n)."""
    return np.stack([smoothed_motion.filtered(problem, x) for x in (
        [m.ddq for m in found], [m.state.dq for m in found],
        [np.ones_like(m.ddq) for m in found])])


def probes(problem, found):
    """Return the places to look of every cause in reach: key -> list of (cause, probe, columns).

    Columns have shape (amplitudes, N, n).
    """
    look, result = smoothed_motion.sizes(problem, found), {}
    for cause in smoothed_motion.regressors(problem, CAUSES):
        group = [(cause, probe, columns(problem, found, cause, probe))
                 for probe in cause.probes(look)]
        if group:
            result[cause.key] = group
    return result


def columns(problem, found, cause, probe):
    """Filtered torque of a probe, with one of its amplitudes at a time."""
    sets = [{name: value if active in (None, name) or name not in probe.amplitudes
             else 0.0 * value for name, value in probe.values.items()}
            for active in probe.amplitudes or (None,)]
    return np.stack([smoothed_motion.filtered(problem, [
        smoothed_motion.opposing(m, cause, _of_log(values, j)) for j, m in enumerate(found)])
        for values in sets])


def _of_log(values, j):
    return {name: value[j] if np.ndim(value) == 2 else value for name, value in values.items()}


def regressed(problem, target, base, looks, subsets=None):
    """Fit some causes at all joints, and leave them out where BIC does.

    Parameters
    ----------
    problem : Problem
        The robot.
    target : ndarray, shape (N, n)
        Filtered torque.
    base : ndarray, shape (3, N, n)
        See `base_columns`.
    looks : tuple
        Entries of `probes`.
    subsets : callable, optional
        ``subsets(k)`` lists what may act at joint k, as positions in looks; by default anything.

    """
    subsets = subsets or (lambda k: _parts(looks))
    n, total = problem.n, 0.0
    numbers = np.zeros((3, n))
    amplitudes = [np.zeros((len(look[2]), n)) for look in looks]
    used = [set() for _ in looks]
    for k in range(n):
        score, theta, inside = min(((*_joint(target[:, k], base[:, :, k], [
            looks[i] for i in part], k), part) for part in subsets(k)), key=lambda one: one[0])
        total += score
        numbers[:, k] = theta[:3]
        at = 3
        for i in inside:
            width = len(amplitudes[i])
            amplitudes[i][:, k] = theta[at:at + width]
            used[i].add(k)
            at += width
    members = tuple(_member(look, amplitude, sorted(joints))
                    for look, amplitude, joints in zip(looks, amplitudes, used) if joints)
    inertia, damping, load = numbers
    stated = problem.nominal.inertia
    return Model(members, total, {"inertia": np.maximum(inertia, 0.2 * stated),
                                  "damping": np.maximum(damping, 0.0), "load": load})


def _parts(looks):
    """Subsets of the causes of a model, as positions; none of them comes first."""
    for count in range(len(looks) + 1):
        yield from itertools.combinations(range(len(looks)), count)


def _joint(target, base, parts, k):
    """BIC and numbers of joint k with some causes; infinite where a number has no meaning."""
    matrix = np.concatenate([base, *(look[2][:, :, k] for look in parts)]).T
    theta = np.linalg.lstsq(matrix, target, rcond=None)[0]
    lower = np.concatenate([np.zeros(2), [-np.inf], *(_lower(look) for look in parts)])
    if np.any(theta < lower):
        return (np.inf if parts else 1e300), theta
    left = target - matrix @ theta
    return bic(left @ left, len(target), len(theta)), theta


def _lower(look):
    numbers = {number.name: number for number in look[0].numbers}
    return [0.0 if numbers[name].lower == 0.0 else -np.inf for name in look[1].amplitudes] or [0.0]


def _member(look, amplitude, joints):
    cause, probe, _ = look
    values = {name: np.array(value, float) for name, value in probe.values.items()}
    for name, factor in zip(probe.amplitudes, amplitude):
        values[name] = values[name] * factor
    return Member(cause, tuple(joints), values, probe.values)
