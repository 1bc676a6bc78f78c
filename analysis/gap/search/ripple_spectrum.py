"""Torque ripple of any order: the line spectrum, over the pose, of what a model leaves.

What a torque exp(i N q) would explain is its product with the error sent back through the filters
of the loop.  Gathered by pose, that product is a spectrum in N: one transform tries every order.
"""

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TORQUE_RIPPLE
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.residual.noise import decimation
from clie_blocks.analysis.gap.residual.sensitivity import torque_sensitivity
from clie_blocks.analysis.gap.search.events import torque_columns
from clie_blocks.linear_filters import frequency_response, lfilter

LEAST, MOST = 2 * np.pi, 10.0  # orders looked for: one wave over the travel, per motor turn
ENOUGH = 48.0  # per turn: the top of the range for joints with little gear
TRIED = 3  # lines of the spectrum that are fitted, beside the strongest of each octave
SPEEDS = 60  # classes of speed in which the filters of the loop are taken as constant


def ripple_candidates(bench, base, errors, causes):
    """Return the member of the strongest order of each joint, and what it would explain.

    Returns
    -------
    list of (Member, ndarray)
        Torque ripple at all joints, and the drop of chi^2 on the fit logs per joint; empty if it
        is not among the causes to look for.

    """
    if TORQUE_RIPPLE not in causes:
        return []
    n = bench.problem.n
    found = [max((_explained_drop(bench, base, errors, k, order)
                  for order in _lines(bench, base, errors, k)), key=lambda one: one[0])
             for k in range(n)]
    drop, order, sine, cosine = (np.array(column) for column in zip(*found))
    size = np.hypot(sine, cosine) + 1e-12
    values = {"sine": sine, "cosine": cosine, "order": order}
    travel = np.ptp(np.concatenate([log.q for log in bench.problem.fit]), axis=0)
    sizes = {"sine": size, "cosine": size, "order": 1.0 / (travel + 1e-9)}
    return [(Member(TORQUE_RIPPLE, tuple(range(n)), values, sizes), drop)]


def _lines(bench, base, errors, k):
    """Orders of the strongest lines of joint k."""
    problem = bench.problem
    top = max(MOST * problem.gear_ratio[k], ENOUGH)
    width = np.pi / (2.0 * top)  # of a class of pose
    start = min(log.q[:, k].min() for log in problem.fit)
    travel = max(log.q[:, k].max() for log in problem.fit) - start
    classes = int(travel / width) + 1
    room = 1 << int(np.ceil(np.log2(8 * classes + 64)))
    orders = 2 * np.pi * np.arange(room // 2) / (room * width)
    product, square = 0.0, 0.0
    for j, log in enumerate(problem.fit):
        back = _reflected(bench, base, errors[j][k], j, k)
        place = ((log.q[:, k] - start) / width).astype(int)
        product = product + np.fft.fft(np.bincount(place, back, room))[:room // 2]
        square = square + _power(bench, base, log, k, orders)
    score = np.abs(product) ** 2 / (square + 1e-3 * np.max(square))
    score[(orders < LEAST / (travel + width)) | (orders > top)] = 0.0
    return _peaks(orders, score, room // classes)


def _peaks(orders, score, apart):
    """Orders of the strongest lines, and of the strongest of each octave.

    Where the loop hardly answers, at its top, what other causes leave passes for lines.
    """
    score, found = score.copy(), _strongest_by_octave(orders, score)
    for _ in range(TRIED):
        at = int(np.argmax(score))
        found.add(orders[at])
        score[max(at - apart, 0):at + apart + 1] = 0.0
    return sorted(found)


def _strongest_by_octave(orders, score):
    seen = np.flatnonzero(score)
    octave = np.log2(orders[seen]).astype(int)
    return {orders[seen[octave == each][np.argmax(score[seen[octave == each]])]]
            for each in np.unique(octave)}


def _reflected(bench, base, error, j, k):
    """Product of a whitened error with the response to an impulse of torque at each sample."""
    problem, values = bench.problem, base.hypothesis.values
    whitener = bench.noises[k].whitener
    padded = np.concatenate([np.zeros(len(whitener) - 1), error])
    slow = lfilter(whitener, [1.0], padded[::-1])[::-1]
    width = decimation(problem.period)
    back = np.zeros(len(problem.logs[j]))
    back[:len(slow) * width] = np.repeat(slow / width, width)
    b, a = torque_sensitivity(problem.law, k, values["inertia"][k], values["damping"][k])
    return lfilter(b, a, back[::-1])[::-1]


def _power(bench, base, log, k, orders):
    """Squared size of the whitened response to exp(i N q), by classes of speed."""
    problem, values = bench.problem, base.hypothesis.values
    rate = np.abs(np.gradient(log.q[:, k] - log.dither[:, k], problem.period))
    count, edges = np.histogram(rate, SPEEDS)
    speed = (edges[1:] + edges[:-1]) / 2
    nyquist = np.pi / problem.period
    grid = np.geomspace(1e-3, nyquist, 2000)
    torque = frequency_response(*torque_sensitivity(problem.law, k, values["inertia"][k],
                                          values["damping"][k]), grid * problem.period)
    width = decimation(problem.period)
    slow = grid * problem.period * width
    noise = frequency_response(bench.noises[k].whitener, [1.0], np.minimum(slow, np.pi))
    gain = np.abs(torque * noise * np.sinc(slow / (2 * np.pi))) ** 2 * (slow < np.pi)
    seen = np.interp(np.outer(orders, speed), grid, gain, right=0.0)
    return seen @ count / width


def _explained_drop(bench, base, errors, k, order):
    """Drop of chi^2, order, sine and cosine for one order at joint k."""
    problem = bench.problem
    gram, right = np.zeros((2, 2)), np.zeros(2)
    for j, log in enumerate(problem.fit):
        phase = order * (log.q[:, k] - log.dither[:, k])
        data = torque_columns(bench, base, j, k, np.stack([np.sin(phase), np.cos(phase)], 1))
        gram, right = gram + data.T @ data, right + data.T @ errors[j][k]
    theta = np.linalg.lstsq(gram, right, rcond=None)[0]
    return float(right @ theta), order, *theta
