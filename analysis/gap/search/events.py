"""Causes that come with time are searched, not gridded: a frequency, and the onset of a fault.

Both are torques that do not depend on the model's own motion, so their effect on the error is
their sensitivity-filtered course, and whole families of them are scanned at once.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.fitting.jacobian import joint_columns
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import RATE, whiten
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.screening import unexplained
from clie_blocks.analysis.theory.sampled_loop import decimated_filter
from clie_blocks.linear_filters import lfilter
from clie_blocks.robot_loop.links import tip_load_torque

NEVER = 1e9  # s: onset of a fault that a log does not show
_PADDED = 1 << 16
_RESOLVED = 1e-6  # of the square of a column: less of it is rounding
_ROUNDS = 3  # in which the onsets of all logs are sought in turn
_LOWEST, _HIGHEST = 0.06, 0.4 * RATE  # Hz, of a periodic disturbance

Found = list[tuple[Member, np.ndarray]]
"""Causes at all joints, and the drop of chi^2 on the fit logs per joint."""


class Scan(NamedTuple):
    """What a unit fault from each onset on has in common with an error, and its square.

    `absorbed` are its components along what fitted parameters do, shape (onsets, parameters): a
    constant torque that sets in looks much like an offset, which the fit has moved already.
    """

    product: np.ndarray
    square: np.ndarray
    absorbed: np.ndarray


def whitened_errors(residuals: ResidualModel, fit: Fit) -> list[list[np.ndarray]]:
    """Whitened errors of a fit in all logs: ``[log][joint]``."""
    return [residuals.whitened(fit.hypothesis.error(j), j)
            for j in range(len(residuals.problem.logs))]


def torque_columns(residuals: ResidualModel, fit: Fit, j: int, k: int, torque: np.ndarray,
                   ) -> np.ndarray:
    """Whitened response of joint k in log j to courses of torque that oppose, (N, m)."""
    values = fit.hypothesis.values
    b, a = residuals.problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    moved = whiten(residuals.rows(j).of_samples(-lfilter(b, a, torque)),
                   residuals.noise(j, k).whitener)
    return residuals.without_initial_response(moved, j, k)


def sinusoid_columns(residuals: ResidualModel, fit: Fit, j: int, k: int, phase: np.ndarray,
                     ) -> np.ndarray:
    """Whitened response of joint k in log j to the sine and cosine of a phase, (N, 2)."""
    return torque_columns(residuals, fit, j, k, np.stack([np.sin(phase), np.cos(phase)], 1))


def periodic_candidates(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                        causes: Sequence[Cause]) -> Found:
    """Return the strongest sinusoid of each joint, and what it would explain.

    Empty where the periodic disturbance is not among the causes.
    """
    if PERIODIC_DISTURBANCE not in causes:
        return []
    problem = residuals.problem
    values = {name: np.zeros((len(problem.logs), problem.n)) for name in ("sine", "cosine")}
    frequency, drop = np.ones(problem.n), np.zeros(problem.n)
    for k in range(problem.n):
        frequency[k] = _strongest_frequency([of_log[k] for of_log in errors[:len(problem.fit)]])
        for j, log in enumerate(problem.logs):
            phase = 2 * np.pi * frequency[k] * problem.period * np.arange(len(log))
            columns = sinusoid_columns(residuals, fit, j, k, phase)
            theta = np.linalg.lstsq(columns, errors[j][k], rcond=None)[0]
            values["sine"][j, k], values["cosine"][j, k] = theta
            if j < len(problem.fit):
                drop[k] += float(errors[j][k] @ columns @ theta)
    size = np.max(np.abs([values["sine"], values["cosine"]]), axis=(0, 1)) + 1e-12
    sizes = {"sine": size, "cosine": size, "frequency": 0.01 + 0 * frequency}
    return [(Member(PERIODIC_DISTURBANCE, tuple(range(problem.n)),
                    {**values, "frequency": frequency}, sizes), drop)]


def _strongest_frequency(errors: list[np.ndarray]) -> float:
    """Frequency of the strongest line in the spectra of some errors [Hz]."""
    grid = np.fft.rfftfreq(_PADDED, 1.0 / RATE)
    band = (grid > _LOWEST) & (grid < _HIGHEST)
    power = np.sum([np.abs(np.fft.rfft(error, _PADDED)) ** 2 * 2 / len(error)
                    for error in errors], axis=0)
    return grid[band][np.argmax(power[band])]


def fault_candidates(residuals: ResidualModel, fit: Fit, errors: list[list[np.ndarray]],
                     causes: Sequence[Cause]) -> Found:
    """Return each kind of fault that sets in, and what it would explain.

    The onset may differ between logs, the size does not.
    """
    problem, hypothesis, method = residuals.problem, fit.hypothesis, residuals.method.search
    motion = [hypothesis.positions(j, [hypothesis.values])[0].T for j in range(len(problem.logs))]
    onsets = [first_onsets(len(log) * problem.period, method.fault_margin, method.onset_spacing)
              for log in problem.logs]
    kinds = [cause for cause in STEP_FAULT
             if cause in causes and (problem.links.known or not cause.needs_links)]
    if not kinds:
        return []
    fitted, target = joint_columns(fit, residuals)
    bases = [np.linalg.qr(own)[0] for own in fitted]
    left = [_of_logs(unexplained(own, basis), of_joint, len(problem.fit))
            for own, basis, of_joint in zip(target, bases, zip(*errors))]
    scanners = [_FaultScanner(
        residuals, fit, left, [_of_logs(basis, of_joint, len(problem.fit))
                               for basis, of_joint in zip(bases, zip(*errors))],
        cause, [unit_fault_torque(cause.variant, problem, q) for q in motion])
        for cause in kinds]
    coarse = [scanner.best([onsets] * problem.n) for scanner in scanners]
    best = max((drop.sum() for _, drop in coarse), default=0.0)
    return [scanner.refined(member, drop)
            if drop.sum() >= method.leading_fault_share * best else (member, drop)
            for scanner, (member, drop) in zip(scanners, coarse)]


def _of_logs(rows: np.ndarray, errors: Sequence[np.ndarray], fit_logs: int) -> list[np.ndarray]:
    """Rows of one joint log by log; of a log that is held out its error, or nothing."""
    ends = np.cumsum([len(error) for error in errors[:fit_logs]])
    of_fit = np.split(rows[:ends[-1]], ends[:-1])
    others = [error if rows.ndim == 1 else np.zeros((len(error), rows.shape[1]))
              for error in errors[fit_logs:]]
    return [*of_fit, *others]


def first_onsets(duration: float, margin: float, spacing: float) -> np.ndarray:
    """Onsets over a log [s], but for its ends; in a short log a fault shows at none."""
    onsets = np.arange(margin, duration - margin, spacing)
    return onsets if onsets.size else np.array([NEVER])


@dataclasses.dataclass(frozen=True, eq=False)
class _FaultScanner:
    """One kind of fault, and its unit torque (N, n) in each log, as if it lasted all the time.

    The errors, without what fitted parameters explain, and the columns of these are those of each
    joint, log by log.
    """

    residuals: ResidualModel
    fit: Fit
    errors: list[list[np.ndarray]]
    parameters: list[list[np.ndarray]]
    cause: Cause
    torque: list[np.ndarray]

    def refined(self, member: Member, drop: np.ndarray) -> tuple[Member, np.ndarray]:
        """The same fault with its onsets sought more and more finely."""
        method, n = self.residuals.method.search, self.residuals.problem.n
        steps = method.onset_spacing, *method.onset_refinements
        margin = method.fault_margin
        last = [len(log) * self.residuals.problem.period - margin
                for log in self.residuals.problem.logs]
        for wide, fine in zip(steps, steps[1:]):
            onsets = [[np.clip(np.arange(onset - wide, onset + wide, fine), margin,
                               max(end, margin)) if onset < NEVER else np.array([margin])
                       for onset, end in zip(member.values["onset"][:, k], last)]
                      for k in range(n)]
            member, drop = self.best(onsets)
        return member, drop

    def best(self, onsets: list[list[np.ndarray]]) -> tuple[Member, np.ndarray]:
        """Best size and onsets of the fault among some onsets, ``[joint][log]``."""
        problem, n = self.residuals.problem, self.residuals.problem.n
        size, drop = np.zeros(n), np.zeros(n)
        chosen = np.full((len(problem.logs), n), NEVER)
        for joints in [list(range(n))] if self.cause.shared else [[k] for k in range(n)]:
            tried = onsets[joints[0]]
            scans = [self._scan(j, joints, of_log) for j, of_log in enumerate(tried)]
            best_size, places, gain = _common_size(scans, len(problem.fit))
            size[joints], drop[joints] = best_size, gain / len(joints)
            for j, place in enumerate(places):
                if place is not None:
                    chosen[j, joints] = tried[j][place]
        name = self.cause.numbers[0].name
        return Member(self.cause, tuple(range(n)), {name: size, "onset": chosen},
                      {name: np.abs(size) + 1e-9}), drop

    def _scan(self, j: int, joints: list[int], onsets: np.ndarray) -> Scan:
        """Scan of log j over some onsets, of joints that share the fault."""
        product, square, absorbed = zip(*(self._of_joint(j, k, onsets) for k in joints))
        return Scan(np.sum(product, axis=0), np.sum(square, axis=0), np.hstack(absorbed))

    def _of_joint(self, j: int, k: int, onsets: np.ndarray) -> Scan:
        columns = fault_columns(self.residuals, self.fit, j, k, self.torque[j][:, k], onsets)
        return Scan(columns.T @ self.errors[k][j], (columns**2).sum(axis=0),
                    columns.T @ self.parameters[k][j])


def unit_fault_torque(variant: str, problem: Problem, q: np.ndarray) -> np.ndarray:
    """Torque of a unit fault that lasts the whole log, (N, n)."""
    if variant == "torque":
        return np.ones_like(q)
    dq = np.gradient(q, problem.period, axis=0)
    if variant == "damping":
        return dq
    if variant == "friction":
        return np.sign(dq)
    ddq = np.gradient(dq, problem.period, axis=0)
    return tip_load_torque(problem.links, q, dq, ddq) / problem.gear_ratio


def fault_columns(residuals: ResidualModel, fit: Fit, j: int, k: int, torque: np.ndarray,
                  onsets: np.ndarray) -> np.ndarray:
    """Whitened response of joint k in log j to a torque (N,) from each onset on, (N, onsets)."""
    problem, values = residuals.problem, fit.hypothesis.values
    rows = residuals.rows(j)
    blocks = rows.of_ticks(torque)[:, None]
    ends = np.arange(1, len(blocks) + 1)[:, None]
    share = np.clip(ends - onsets / (rows.ticks * problem.period), 0.0, 1.0)  # of the block
    sensitivity = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    moved = -lfilter(*decimated_filter(*sensitivity, rows.ticks, rows.stride), share * blocks)
    return residuals.without_initial_response(
        whiten(moved, residuals.noise(j, k).whitener), j, k)


def _common_size(scans: Sequence[Scan], fit_logs: int,
                 ) -> tuple[float, list[int | None], float]:
    """Size that serves all fit logs, the best onset of each log (None: never), and the drop.

    Fitted parameters act in all fit logs at once, so that the onset in one log depends on those
    in the others.
    """
    best: tuple[float, list[int | None], float] = (0.0, [None] * len(scans), 0.0)
    for first in range(fit_logs):
        onsets: list[int | None] = [None] * fit_logs
        for j in [*np.roll(np.arange(fit_logs), -first)] * _ROUNDS:
            others = _together([(scan, place) for i, (scan, place) in enumerate(
                zip(scans[:fit_logs], onsets)) if i != j])
            onsets[j] = _best_place(others, scans[j])
        product, square, absorbed = _together(list(zip(scans[:fit_logs], onsets)))
        size, drop = _size_and_drop(product, square, absorbed)
        if drop > best[2]:
            unseen = [2 * size * scan.product - size**2 * scan.square
                      for scan in scans[fit_logs:]]
            best = (float(size), onsets + [int(np.argmax(gain)) if gain.max() > 0 else None
                                           for gain in unseen], float(drop))
    return best


def _together(parts: Sequence[tuple[Scan, int | None]]) -> Scan:
    """Sums over logs, each with the fault from one onset on, or never."""
    shown = [(scan, place) for scan, place in parts if place is not None]
    if not shown:
        return Scan(np.zeros(1), np.zeros(1), np.zeros(1))
    return Scan(*(np.sum([scan[i][place] for scan, place in shown], axis=0) for i in range(3)))


def _best_place(others: Scan, scan: Scan) -> int | None:
    """Onset in one log with which a fault explains most, beside those in other logs."""
    _, without = _size_and_drop(*others)
    _, drops = _size_and_drop(others.product + scan.product, others.square + scan.square,
                              others.absorbed + scan.absorbed)
    place = int(np.argmax(drops))
    return place if drops[place] > without else None


def _size_and_drop(product: np.ndarray, square: np.ndarray, absorbed: np.ndarray,
                   ) -> tuple[np.ndarray, np.ndarray]:
    """Size at which a fault explains most, while fitted parameters follow, and its drop."""
    own = square - (absorbed**2).sum(axis=-1) + _RESOLVED * square + 1e-12
    return product / own, product**2 / own
