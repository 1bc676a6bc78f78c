"""Ripple of any order: the line spectrum, over the pose, of what a model leaves.

The ripple of a motor is a torque, that of its commutation a share of the drive's torque, and that
of a gear's teeth a share of their load; an uneven friction turns with the motion.  What a torque
exp(i N q), or such a share, would explain is its product with the error sent back through the
filters of the loop.  Gathered by pose, that product is a spectrum in N: one transform tries every
order.
"""

from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.drive import (
    COMMUTATION_RIPPLE,
    GEAR_MESH_RIPPLE,
    PRELOAD,
    TORQUE_RIPPLE,
    counts_motor_turns,
)
from clie_blocks.analysis.gap.causes.friction import POSITION_DEPENDENT_FRICTION
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.method.search import SearchMethod
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.events import Found, torque_columns
from clie_blocks.linear_filters import frequency_response, lfilter

_SPEEDS = 60  # classes of speed in which the filters of the loop are taken as constant
_POWERS = 1024  # orders, in equal ratios, at which the power of a response is computed


class _Ripple(NamedTuple):
    """One order at one joint, and the drop of chi^2 that it explains."""

    drop: float
    order: float
    sine: float
    cosine: float


_NO_RIPPLE = _Ripple(0.0, 1.0, 0.0, 0.0)


class _Kind(NamedTuple):
    """A kind of ripple.

    Its torque is a wave of the position times ``course(j, k)`` in log j at joint k; `most` are the
    waves per joint turn that are sought whatever the gear ratio; ``others(size)`` are the further
    parameters of a wave of some size.
    """

    cause: Cause
    course: Callable[[int, int], np.ndarray]
    most: float = 0.0
    others: Callable[[np.ndarray], dict[str, np.ndarray]] = lambda size: {}


def ripple_candidates(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                      causes: Sequence[Cause], joints: Collection[int]) -> Found:
    """Return the strongest order for each kind of ripple, and what it explains, at some joints."""
    problem, found = residuals.problem, Found()
    logs = problem.fit
    forward = [np.sign(np.gradient(log.q - fit.hypothesis.error(j), axis=0))
               for j, log in enumerate(logs)]
    preload = PRELOAD * problem.rms_command
    kinds = (
        _Kind(TORQUE_RIPPLE, lambda j, k: np.ones(len(logs[j]))),
        _Kind(COMMUTATION_RIPPLE, lambda j, k: -logs[j].u[:, k]),
        _Kind(GEAR_MESH_RIPPLE, lambda j, k: preload[k] + np.abs(logs[j].u[:, k]),
              residuals.method.search.ripple_most_teeth, lambda size: {"preload": preload}),
        _Kind(POSITION_DEPENDENT_FRICTION, lambda j, k: forward[j][:, k],
              others=lambda size: {"level": size}))
    travel = np.ptp(np.concatenate([log.q for log in problem.fit]), axis=0)
    sought = [kind for kind in kinds if kind.cause in causes]
    by_joint = [_ripples_of_joint(residuals, fit, errors, k, sought) if k in joints
                else [_NO_RIPPLE] * len(sought) for k in range(problem.n)]
    for kind, ripples in zip(sought, zip(*by_joint)):
        drop, order, sine, cosine = (np.array(column) for column in zip(*ripples))
        size = np.hypot(sine, cosine) + 1e-12
        others = kind.others(size)
        values = {"sine": sine, "cosine": cosine, "order": order, **others}
        sizes = {"sine": size, "cosine": size, "order": 1.0 / (travel + 1e-9), **others}
        found.append((Member(kind.cause, tuple(range(problem.n)), values, sizes), drop))
    return found


def _ripples_of_joint(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]], k: int,
                      kinds: Sequence[_Kind]) -> list[_Ripple]:
    """The strongest ripple of each kind at joint k; the order of one is tried for the others."""
    if not kinds:
        return []
    needed = [needed_torque(residuals, fit, errors[j][k], j, k)
              for j in range(len(residuals.problem.fit))]
    own = [_strongest_ripple(residuals, fit, errors, k, kind, needed) for kind in kinds]
    orders = {ripple.order for ripple in own}
    strongest = []
    for kind, ripple in zip(kinds, own):
        others = [_fitted_ripple(residuals, fit, errors, k, order, kind)
                  for order in orders - {ripple.order}]
        strongest.append(max([ripple, *others], key=_drop_of))
    return strongest


def _drop_of(ripple: _Ripple) -> float:
    return ripple.drop


def _strongest_ripple(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]], k: int,
                      kind: _Kind, needed: Sequence[np.ndarray]) -> _Ripple:
    orders = _strongest_orders(residuals, fit, errors, k, kind, needed)
    return max((_fitted_ripple(residuals, fit, errors, k, order, kind) for order in orders),
               key=_drop_of)


def _strongest_orders(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]], k: int,
                      kind: _Kind, needed: Sequence[np.ndarray]) -> list[float]:
    """Orders of the strongest lines of joint k, in all logs together and in each of them.

    A log in which a joint rests at a few poses may leave most of all, and tells orders least.  So
    each log counts for itself, by the torque that its error needs.
    """
    problem, method = residuals.problem, residuals.method.search
    top = max(highest_order(problem.gear_ratio[k], method), kind.most)
    width = np.pi / (2.0 * top)  # of a class of pose
    start = min(log.q[:, k].min() for log in problem.fit)
    travel = max(log.q[:, k].max() for log in problem.fit) - start
    classes = int(travel / width) + 1
    padded = 1 << int(np.ceil(np.log2(8 * classes + 64)))
    orders = 2 * np.pi * np.arange(padded // 2) / (padded * width)
    lowest = 2 * np.pi * method.ripple_least_waves / (travel + width)
    beyond, apart = (orders < lowest) | (orders > top), padded // classes
    product, power = np.zeros(padded // 2, complex), np.zeros(padded // 2)
    lines = set[float]()
    for j, log in enumerate(problem.fit):
        torque = kind.course(j, k)
        pose_class = ((log.q[:, k] - start) / width).astype(int)
        back = torque * sent_back(residuals, fit, errors[j][k], j, k)
        product = product + _by_order(back, pose_class, padded)
        power = power + _response_power(residuals, fit, j, k, orders, torque)
        alone = np.abs(_by_order(torque * needed[j], pose_class, padded))
        alone[beyond] = 0.0
        lines |= _strongest_apart(orders, alone, apart, method.ripple_lines_of_log)
    score = np.abs(product) ** 2 / (power + 1e-3 * np.max(power))
    score[beyond] = 0.0
    return sorted(lines | strongest_lines(orders, score, apart, method.ripple_lines))


def _by_order(of_samples: np.ndarray, pose_class: np.ndarray, padded: int) -> np.ndarray:
    """Spectrum over the pose of what is gathered in classes of it."""
    return np.fft.fft(np.bincount(pose_class, of_samples, padded))[:padded // 2]


def highest_order(gear_ratio: float, method: SearchMethod) -> float:
    """Largest order that is sought [waves per joint turn].

    A gear ratio of one says that torques are on the joint side, where the motor's turns are not
    counted: any usual gear may stand between them and the joint's.
    """
    per_turn = (method.ripple_most_per_turn if counts_motor_turns(gear_ratio)
                else method.ripple_most_behind_gear)
    return max(method.ripple_most_per_motor_turn * gear_ratio, per_turn)


def strongest_lines(orders: np.ndarray, score: np.ndarray, apart: int, count: int) -> set[float]:
    """Orders of the strongest lines, and of the strongest of each octave.

    Where the loop hardly responds, at its top, what other causes leave passes for lines.
    """
    return _strongest_by_octave(orders, score) | _strongest_apart(orders, score, apart, count)


def _strongest_apart(orders: np.ndarray, score: np.ndarray, apart: int, count: int) -> set[float]:
    score, lines = score.copy(), set[float]()
    for _ in range(count):
        best = int(np.argmax(score))
        lines.add(orders[best])
        score[max(best - apart, 0):best + apart + 1] = 0.0
    return lines


def _strongest_by_octave(orders: np.ndarray, score: np.ndarray) -> set[float]:
    scored = np.flatnonzero(score)
    octave = np.log2(orders[scored]).astype(int)
    by_octave = [scored[octave == each] for each in np.unique(octave)]
    return {orders[some[np.argmax(score[some])]] for some in by_octave}


def sent_back(residuals: ResidualModel, fit: Fit, error: np.ndarray, j: int, k: int,
               ) -> np.ndarray:
    """Product of a whitened error with the response to an impulse of torque at each sample."""
    problem, values = residuals.problem, fit.hypothesis.values
    whitener, rows = residuals.noise(j, k).whitener, residuals.rows(j)
    padded = np.concatenate([np.zeros(len(whitener) - 1), error])
    slow = lfilter(whitener, [1.0], padded[::-1])[::-1]
    back = np.zeros(len(problem.logs[j]))
    samples = len(slow) * rows.width
    back[::rows.stride][:samples] = np.repeat(slow / rows.width, rows.width)
    b, a = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    return lfilter(b, a, back[::-1])[::-1]


def needed_torque(residuals: ResidualModel, fit: Fit, error: np.ndarray, j: int, k: int,
                  ) -> np.ndarray:
    """Torque that leaves the error of joint k in log j, as far as noise lets it be seen.

    Without this the loop, which answers most near its bandwidth, would decide what looks alike.
    """
    impulse = np.zeros((len(residuals.problem.logs[j]), 1))
    impulse[len(impulse) // 2] = 1.0
    response = torque_columns(residuals, fit, j, k, impulse)[:, 0]
    power = np.abs(np.fft.rfft(sent_back(residuals, fit, response, j, k)))
    noise = power.mean() / max(float(np.mean(error**2)), 1.0)
    back = sent_back(residuals, fit, error, j, k)
    return np.fft.irfft(np.fft.rfft(back) / (power + noise), len(back))


def _response_power(residuals: ResidualModel, fit: Fit, j: int, k: int, orders: np.ndarray,
                    torque: np.ndarray) -> np.ndarray:
    """Squared size of the whitened response in log j to torque exp(i N q) for each order N.

    The orders are sorted and begin at zero.
    """
    problem, values = residuals.problem, fit.hypothesis.values
    log, rows = problem.logs[j], residuals.rows(j)
    speeds = np.abs(np.gradient(log.q[:, k] - log.dither[:, k], problem.period))
    count, edges = np.histogram(speeds, _SPEEDS, weights=torque**2)
    speed = (edges[1:] + edges[:-1]) / 2
    frequency = np.geomspace(1e-3, np.pi / problem.period, 2000)
    sensitivity = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    torque = frequency_response(*sensitivity, frequency * problem.period)
    slow = frequency * problem.period * rows.ticks
    noise = frequency_response(residuals.noise(j, k).whitener, [1.0], np.minimum(slow, np.pi))
    averaged = np.sinc(slow / (2 * np.pi)) if rows.width > 1 else 1.0
    gain = np.abs(torque * noise * averaged) ** 2 * (slow < np.pi)
    some = np.append(0.0, np.geomspace(orders[1], orders[-1], min(len(orders), _POWERS)))
    power = np.interp(np.outer(some, speed), frequency, gain, right=0.0) @ count / rows.ticks
    return np.interp(orders, some, power)


def _fitted_ripple(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]], k: int,
                   order: float, kind: _Kind) -> _Ripple:
    """Sine and cosine of one order at joint k by least squares over the fit logs."""
    gram, right = np.zeros((2, 2)), np.zeros(2)
    for j, log in enumerate(residuals.problem.fit):
        phase = order * (log.q[:, k] - log.dither[:, k])
        waves = kind.course(j, k)[:, None] * np.stack([np.sin(phase), np.cos(phase)], 1)
        columns = torque_columns(residuals, fit, j, k, waves)
        gram, right = gram + columns.T @ columns, right + columns.T @ errors[j][k]
    sine, cosine = theta = np.linalg.lstsq(gram, right, rcond=None)[0]
    return _Ripple(float(right @ theta), order, sine, cosine)
