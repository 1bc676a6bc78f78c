"""First question to a log: did the stated controller run?  It is answered without any model.

Replaying the law on the measured positions must give the logged command up to its rounding.  If
not, its gains and its velocity estimate are fitted to the log; the rest of the diagnosis then goes
on with the law that really ran, so that a wrong description never poses as a fault of the robot.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import first_known_sample, law_residual
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
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.analysis.records.velocity_filter import discretisations, velocity_filter
from clie_blocks.linear_filters import lfilter

SLOWER = 4  # times the settling of the stated filter: what a slower one that ran may take


@dataclasses.dataclass(frozen=True, eq=False)
class ControllerCheck:
    """What replaying the law showed.

    Parameters
    ----------
    replay_error : ndarray, shape (n,)
        RMS of logged less replayed command [N m].
    limit : ndarray, shape (n,)
        Largest RMS that rounding explains [N m].
    wrong : tuple of int
        Joints whose velocity estimate is not the stated one.
    corners : ndarray, shape (2, n)
        High-pass and low-pass corner that fit the log [rad/s]; the stated ones elsewhere.
    coarse : tuple of int
        Joints whose encoder steps are larger than stated.
    step : ndarray, shape (n,)
        Step of the logged position [rad].
    law : ControlLaw
        The law that ran, as far as the log tells.
    decisions : tuple of str
        What was decided, in words.
    gains : tuple of int
        Joints whose gains are not the stated ones.
    late : bool
        Commands are sent one period after they were worked out.
    integral : tuple of float
        Integral gain of each joint that the file does not name [N m/(rad s)]; empty without.

    """

    replay_error: np.ndarray
    limit: np.ndarray
    wrong: tuple[int, ...]
    corners: np.ndarray
    coarse: tuple[int, ...]
    step: np.ndarray
    law: Law
    decisions: tuple[str, ...]
    gains: tuple[int, ...] = ()
    late: bool = False
    integral: tuple[float, ...] = ()

    @property
    def misdescribed(self) -> bool:
        """Whether the law that ran moves the robot in another way than the stated one."""
        return bool(self.wrong or self.gains or self.late or self.integral)

    def with_decisions(self, decisions: Sequence[str]) -> "ControllerCheck":
        """The check with further decisions."""
        return dataclasses.replace(self, decisions=(*self.decisions, *decisions))

    def corrected(self, problem: Problem) -> Problem:
        """Problem with the law that ran."""
        ran = dataclasses.replace(problem, law=self.law)
        ran = with_integral(ran, np.array(self.integral)) if self.integral else ran
        return with_command_delay(ran) if self.late else ran


def replay_controller(problem: Problem) -> ControllerCheck:
    """Replay the stated law on every log and correct what of it did not run."""
    law: StatedLaw = problem.law
    decisions: list[str] = []
    limit = _limits(problem)
    error = _replay_error(problem, law)
    if law.corners and (error > limit).any():
        law, error = _other_discretisation(problem, law, error, limit, decisions)
    in_row_before = delayed_replay_error(problem, law)
    late = bool((error > limit).any() and (in_row_before <= limit).all())
    if late:
        error = in_row_before
        decisions.append(DELAYED_COMMANDS)
    corners = np.tile(np.array(law.corners or (np.nan, np.nan))[:, None], problem.n)
    wrong = []
    error, integral = _integral(problem, law, error, limit, decisions)
    law, gains = _other_gains(problem, law, error, limit, decisions)
    suspects = [int(k) for k in np.flatnonzero(error > limit) if k not in gains]
    for k in suspects if law.corners else ():
        corners[:, k] = _fitted_corners(problem, law, k)
        candidate = law.with_filter(slice(k, k + 1), law.variant, corners[:, k])
        after = _replay_error(problem, candidate)[k]
        if after < 0.5 * error[k]:
            law, wrong = candidate, [*wrong, k]
            decisions.append(
                f"{problem.joints[k]}: the velocity filter that ran has corners "
                f"{corners[0, k]:.0f} and {corners[1, k]:.0f} rad/s, not the stated ones")
    step, coarse = _encoder_steps(problem)
    return ControllerCheck(error, limit, tuple(wrong), corners, coarse, step, law,
                           tuple(decisions), gains, late, integral)


def _limits(problem: Problem) -> np.ndarray:
    return rounding_limit(np.concatenate([log.u for log in problem.logs]), problem.law.resolution)


def _replay_error(problem: Problem, law: StatedLaw) -> np.ndarray:
    squares = [np.mean(law_residual(law, log) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def _other_discretisation(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
                          decisions: list[str]) -> tuple[StatedLaw, np.ndarray]:
    for name in discretisations(law.period, law.corners):
        other = law.with_filter(slice(None), name, law.corners)
        found = _replay_error(problem, other)
        if (found <= limit).all() and name != law.variant:
            decisions.append(f"the velocity filter runs as '{name}', not '{law.variant}'; "
                             "no fault of the robot, the file is wrong")
            return other, found
    return law, error


def _integral(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
              decisions: list[str]) -> tuple[np.ndarray, tuple[float, ...]]:
    """Replay error with an integral part where that explains the command, and its gains."""
    if not (error > limit).any():
        return error, ()
    gains = integral_gains(problem, law)
    left = _replay_error(with_integral(problem, gains), law)
    found = (error > limit) & (left <= limit)
    if not found.any():
        return error, ()
    decisions += [describe_integral(problem.joints[k], gains[k]) for k in np.flatnonzero(found)]
    return np.where(found, left, error), tuple(np.where(found, gains, 0.0).tolist())


def _other_gains(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
                 decisions: list[str]) -> tuple[StatedLaw, tuple[int, ...]]:
    """Law with gains that explain the command to its rounding, and the joints that needed them."""
    stated, found = law, []
    for k in np.flatnonzero(error > limit):
        candidate = with_fitted_gains(problem, law, k)
        if _replay_error(problem, candidate)[k] <= limit[k]:
            law, found = candidate, [*found, int(k)]
            decisions.append(describe_gains(problem.joints[k], stated, law, k))
    return law, tuple(found)


def _fitted_corners(problem: Problem, law: StatedLaw, k: int) -> np.ndarray:
    """Corners of G1 whose replay is nearest to the logged command of joint k."""
    from scipy.optimize import least_squares

    log = problem.logs[0]
    first = min(SLOWER * first_known_sample(log, law), len(log) // 2)
    moved = log.q[:, k] - log.q[0, k]
    target = law.kp[k] * (log.q_d[:, k] - log.q[:, k]) + log.pe[:, k] - log.u[:, k]

    def error(exponents: np.ndarray) -> np.ndarray:
        b, a = velocity_filter(law.variant, law.period, np.exp(exponents))
        return (law.kd[k] * lfilter(b, a, moved) - target)[first:]

    starts = np.log(np.array(law.corners)) + np.array([[0.0, 0.0], [-0.7, -0.7], [0.7, 0.7]])
    found = [least_squares(error, start, x_scale=0.1, max_nfev=40) for start in starts]
    return np.sort(np.exp(min(found, key=lambda result: result.cost).x))


def _encoder_steps(problem: Problem) -> tuple[np.ndarray, tuple[int, ...]]:
    """Smallest step between logged positions, and the joints where it exceeds the stated one."""
    step = np.zeros(problem.n)
    for k in range(problem.n):
        values = [np.diff(np.unique(np.round(log.q[:, k], 9))) for log in problem.logs]
        values = np.concatenate([v[v > 1e-8] for v in values] or [np.zeros(0)])
        step[k] = values.min() if values.size else 0.0
    stated = problem.resolution
    coarse = tuple(int(k) for k in np.flatnonzero((stated > 0) & (step > 1.5 * stated)))
    return step, coarse
