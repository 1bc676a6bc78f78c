"""First question to the logs: did the stated controller run?  It needs no model of the robot.

Replaying the law on the measured positions must give the logged command up to its rounding.  If
not, its gains and its velocity estimate are fitted to the log.  The diagnosis then continues with
the law that really ran, so that a wrong description is not mistaken for a fault of the robot.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import (
    first_known_sample,
    known_samples,
    law_residual,
)
from clie_blocks.analysis.gap.controller.refit import (
    DELAYED_COMMANDS,
    delayed_replay_error,
    describe_gains,
    describe_integral,
    integral_gains,
    with_command_delay,
    with_fitted_gains,
    with_integral,
)
from clie_blocks.analysis.gap.controller.terms import (
    Terms,
    find_terms,
    with_recorded_commands,
    with_unknown_law,
)
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.analysis.records.velocity_filter import discretisations, velocity_filter
from clie_blocks.linear_filters import lfilter

# The first samples of a cut log are left out of the fit of its filter, as the state of the filter
# is unknown there: so many times the settling of the stated filter, for one that is slower.
SLOWEST_FILTER = 4
COARSE_STEP = 1.5  # times the stated step of the encoder: a larger step is another one


@dataclasses.dataclass(frozen=True, eq=False)
class ControllerCheck:
    """What replaying the law showed.

    Parameters
    ----------
    replay_error : ndarray, shape (n,)
        RMS of logged less replayed command [N m].
    limit : ndarray, shape (n,)
        Largest RMS that rounding explains [N m].
    other_filter : tuple of int
        Joints whose velocity estimate is not the stated one.
    corners : ndarray, shape (2, n)
        High-pass and low-pass corner that fit the log [rad/s]; the stated ones elsewhere.
    coarse : tuple of int
        Joints whose encoder steps are larger than stated.
    step : ndarray, shape (n,)
        Step of the logged position [rad].
    law : Law
        The law that ran, as far as the logs show it.
    decisions : tuple of str
        What was decided, one sentence each.
    differences : tuple of str
        Those of them that say how the law that ran differs from the stated one.
    other_gains : tuple of int
        Joints whose gains are not the stated ones.
    delayed : bool
        Commands are sent one period after they were computed.
    integral : tuple of float
        Integral gain of each joint that the file does not state [N m/(rad s)]; empty without.
    terms : tuple of Terms
        Known terms that the command of a joint contains beyond the law.
    unexplained : tuple of int
        Joints whose command follows neither the stated law nor any that was found.
    recorded : bool
        Where the law leaves part of a command, models follow the recorded command.
    unknown_part : bool
        The commands that models follow hold more than the law and a logged excitation.
    open_loop : bool
        Models follow all recorded commands, and the stated law is left out.
    reading : float
        Probability that this is what moved the robot, rather than the law as it is known.

    """

    replay_error: np.ndarray
    limit: np.ndarray
    other_filter: tuple[int, ...]
    corners: np.ndarray
    coarse: tuple[int, ...]
    step: np.ndarray
    law: Law
    decisions: tuple[str, ...]
    differences: tuple[str, ...] = ()
    other_gains: tuple[int, ...] = ()
    delayed: bool = False
    integral: tuple[float, ...] = ()
    terms: tuple[Terms, ...] = ()
    unexplained: tuple[int, ...] = ()
    recorded: bool = False
    unknown_part: bool = False
    open_loop: bool = False
    reading: float = 1.0

    @property
    def as_stated(self) -> bool:
        """Whether the stated law gives the logged commands."""
        return not (self.misdescribed or self.terms or self.unexplained)

    @property
    def misdescribed(self) -> bool:
        """Whether the law that ran is known, and another one than is stated."""
        return bool(self.other_filter or self.other_gains or self.delayed or self.integral)

    @property
    def is_another_law(self) -> bool:
        """Whether a law ran that neither the file states nor an effect of the library makes."""
        return bool(self.other_gains or self.integral or self.unknown_part)

    def with_decisions(self, decisions: Sequence[str]) -> "ControllerCheck":
        """The check with further decisions."""
        return dataclasses.replace(self, decisions=(*self.decisions, *decisions))

    def corrected(self, problem: Problem) -> Problem:
        """Problem with the law that ran."""
        if self.open_loop:
            return with_unknown_law(problem)
        corrected = dataclasses.replace(problem, law=self.law)
        if self.integral:
            corrected = with_integral(corrected, np.array(self.integral))
        if self.delayed:
            corrected = with_command_delay(corrected)
        return with_recorded_commands(corrected, self.left_joints) if self.recorded else corrected

    @property
    def left_joints(self) -> tuple[int, ...]:
        """Joints whose commands contain more than the law gives."""
        return (*(one.joint for one in self.terms), *self.unexplained)


def replay_controller(problem: Problem) -> ControllerCheck:
    """Replay the stated law on every log and correct what of it did not run."""
    law, decisions = problem.stated_law, list[str]()
    limit = rounding_limit(np.concatenate([log.u for log in problem.logs]), law.resolution,
                           problem.resolution * law.position_gain())
    error = _replay_error(problem, law)
    if (error > limit).any():
        law, error = _other_discretisation(problem, law, error, limit, decisions)
    delayed_error = delayed_replay_error(problem, law)
    delayed = bool((error > limit).any() and (delayed_error <= limit).all())
    if delayed:
        error = delayed_error
        decisions.append(DELAYED_COMMANDS)
    error, integral = _integral(problem, law, error, limit, decisions)
    law, other_gains = _other_gains(problem, law, error, limit, decisions)
    unexplained = [k for k in _joints(error > limit) if k not in other_gains]
    law, corners, other_filter = _other_filters(problem, law, limit, unexplained, decisions)
    unexplained = [k for k in unexplained if k not in other_filter]
    differences = tuple(decisions)
    terms = find_terms(problem, law, limit, unexplained)
    decisions += [one.describe(problem.joints[one.joint]) for one in terms]
    named = {one.joint for one in terms}
    step, coarse = _encoder_steps(problem)
    return ControllerCheck(
        error, limit, other_filter, corners, coarse, step, law, tuple(decisions), differences,
        other_gains, delayed, integral, terms, tuple(k for k in unexplained if k not in named),
        recorded=bool(terms))


def assume_stated_law(problem: Problem) -> ControllerCheck:
    """Result for a controller that runs more often than any log has samples."""
    law, zero = problem.stated_law, np.zeros(problem.n)
    corners = np.full((2, problem.n), np.nan)
    if law.corners is not None:
        corners[:] = np.array(law.corners)[:, None]
    step, coarse = _encoder_steps(problem)
    return ControllerCheck(zero, zero + np.inf, (), corners, coarse, step, law, (
        f"the controller runs every {1e3 * law.period:.3g} ms, more often than the logs have "
        "samples: its law cannot be replayed and is taken as stated",))


def _joints(mask: np.ndarray) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(mask))


def _replay_error(problem: Problem, law: StatedLaw) -> np.ndarray:
    """Largest RMS of the residual of all logs [N m], shape (n,)."""
    squares = [np.mean(law_residual(law, log) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def _other_discretisation(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
                          decisions: list[str]) -> tuple[StatedLaw, np.ndarray]:
    """Law with the discretisation of its filter that ran, and its replay error."""
    if law.corners is None:
        return law, error
    for name in discretisations(law.period, law.corners):
        candidate = law.with_filter(slice(None), name, law.corners)
        candidate_error = _replay_error(problem, candidate)
        if (candidate_error <= limit).all() and name != law.variant:
            decisions.append(f"the velocity filter runs as '{name}', not '{law.variant}'; "
                             "no fault of the robot, the robot file is wrong")
            return candidate, candidate_error
    return law, error


def _integral(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
              decisions: list[str]) -> tuple[np.ndarray, tuple[float, ...]]:
    """Replay error with an integral part where that explains the command, and its gains."""
    if not (error > limit).any():
        return error, ()
    gains = integral_gains(problem, law)
    error_with_integral = _replay_error(with_integral(problem, gains), law)
    explained = (error > limit) & (error_with_integral <= limit)
    if not explained.any():
        return error, ()
    decisions += [describe_integral(problem.joints[k], gains[k]) for k in _joints(explained)]
    return (np.where(explained, error_with_integral, error),
            tuple(np.where(explained, gains, 0.0).tolist()))


def _other_gains(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
                 decisions: list[str]) -> tuple[StatedLaw, tuple[int, ...]]:
    """Law with gains that explain the command to its rounding, and the joints that have them."""
    stated, joints = law, list[int]()
    for k in _joints(error > limit):
        candidate = with_fitted_gains(problem, law, k)
        if _replay_error(problem, candidate)[k] <= limit[k]:
            law = candidate
            joints.append(k)
            decisions.append(describe_gains(problem.joints[k], stated, law, k))
    return law, tuple(joints)


def _other_filters(problem: Problem, law: StatedLaw, limit: np.ndarray, unexplained: Sequence[int],
                   decisions: list[str]) -> tuple[StatedLaw, np.ndarray, tuple[int, ...]]:
    """Law with the corners that ran, the corners of each joint, and the joints with other ones."""
    corners = np.full((2, problem.n), np.nan)
    if law.corners is None:
        return law, corners, ()
    corners[:] = np.array(law.corners)[:, None]
    joints: list[int] = []
    for k in unexplained:
        high_pass, low_pass = _fitted_corners(problem, law, law.corners, k)
        candidate = law.with_filter(slice(k, k + 1), law.variant, (high_pass, low_pass))
        if _replay_error(problem, candidate)[k] <= limit[k]:
            law = candidate
            joints.append(k)
            corners[:, k] = high_pass, low_pass
            decisions.append(
                f"{problem.joints[k]}: the velocity filter that ran has corners "
                f"{high_pass:.0f} and {low_pass:.0f} rad/s, not the stated ones")
    return law, corners, tuple(joints)


def _fitted_corners(problem: Problem, law: StatedLaw, stated: tuple[float, float], k: int,
                    ) -> tuple[float, float]:
    """Corners of G1 whose replay is nearest to the logged command of joint k."""
    from scipy.optimize import least_squares

    log = problem.logs[0]
    first = min(SLOWEST_FILTER * first_known_sample(log, law), len(log) // 2)
    used = slice(first, None) if log.measured is None else known_samples(log, law)
    moved = log.q[:, k] - log.q[0, k]
    damping_torque = law.kp[k] * (log.q_d[:, k] - log.q[:, k]) + log.pe[:, k] - log.u[:, k]

    def error(exponents: np.ndarray) -> np.ndarray:
        b, a = velocity_filter(law.variant, law.period, np.exp(exponents))
        return (law.kd[k] * lfilter(b, a, moved) - damping_torque)[used]

    starts = np.log(np.array(stated)) + np.array([[0.0, 0.0], [-0.7, -0.7], [0.7, 0.7]])
    fits = [least_squares(error, start, x_scale=0.1, max_nfev=40) for start in starts]
    high_pass, low_pass = np.sort(np.exp(min(fits, key=lambda fit: fit.cost).x))
    return float(high_pass), float(low_pass)


def _encoder_steps(problem: Problem) -> tuple[np.ndarray, tuple[int, ...]]:
    """Smallest step between logged positions, and the joints where it exceeds the stated one."""
    step = np.array([_smallest_step(problem.logs, k) for k in range(problem.n)])
    stated = problem.resolution
    return step, _joints((stated > 0) & (step > COARSE_STEP * stated))


def _smallest_step(logs: Sequence[Log], k: int) -> float:
    """Smallest difference of two positions of joint k in one log [rad]; 0 where it never moves."""
    steps = np.concatenate([np.diff(np.unique(np.round(log.measured_q[:, k], 9)))
                            for log in logs])
    steps = steps[steps > 1e-8]  # smaller ones are rounding
    return float(steps.min()) if steps.size else 0.0
