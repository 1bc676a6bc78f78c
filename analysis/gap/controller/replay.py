"""First question to the logs: did the stated controller run?  It needs no model of the robot.

Replaying the law on the measured positions must give the logged command up to its rounding.  If
not, the law with one effect of the catalogue in it may.  The diagnosis then continues with the law
that really ran, so that a wrong description is not mistaken for a fault of the robot.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import (
    first_known_sample,
    known_samples,
    law_residual,
)
from clie_blocks.analysis.gap.controller.named import (
    ALIKE,
    Found,
    NamedJoint,
    explanations,
)
from clie_blocks.analysis.gap.controller.refit import (
    DELAYED_COMMANDS,
    delayed_replay_error,
    describe_gains,
    describe_integral,
    with_command_delay,
    with_commands_of_law,
    with_gain_error,
)
from clie_blocks.analysis.gap.controller.replayed_joint import joint_of
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
FILTER, LAG = "velocity_filter_mismatch", "velocity_estimate_lag"
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
    named : tuple of NamedJoint
        Joints whose commands the stated law gives with an effect of the catalogue in it.
    terms : tuple of Terms
        Known terms that the command of a joint contains beyond the law.
    unexplained : tuple of int
        Joints whose command follows neither the stated law nor any that was found.
    recorded : bool
        Where nothing known gives a part of a command, models follow the recorded command.
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
    named: tuple[NamedJoint, ...] = ()
    terms: tuple[Terms, ...] = ()
    unexplained: tuple[int, ...] = ()
    recorded: bool = False
    unknown_part: bool = False
    open_loop: bool = False
    reading: float = 1.0

    @property
    def as_stated(self) -> bool:
        """Whether the stated law gives the logged commands."""
        return not (self.misdescribed or self.named or self.terms or self.unexplained)

    @property
    def misdescribed(self) -> bool:
        """Whether the law that ran is known, and another one than is stated."""
        return bool(self.other_filter or self.delayed
                    or any(not one.is_of_recorder for one in self.named))

    def with_decisions(self, decisions: Sequence[str]) -> "ControllerCheck":
        """The check with further decisions."""
        return dataclasses.replace(self, decisions=(*self.decisions, *decisions))

    def corrected(self, problem: Problem) -> Problem:
        """Problem with the law that ran."""
        if self.open_loop:
            return with_unknown_law(problem)
        corrected = dataclasses.replace(problem, law=self.law)
        if self.delayed:
            corrected = with_command_delay(corrected)
        corrected = with_commands_of_law(corrected, {
            one.joint: round(one.found[0].values.get("skew", 0.0) / problem.period)
            for one in self.named if one.is_of_recorder})
        left = (*self.followed_joints, *(self.left_joints if self.recorded else ()))
        return with_recorded_commands(corrected, left) if left else corrected

    @property
    def followed_joints(self) -> tuple[int, ...]:
        """Joints with a named effect that models do not hold: they follow the logged command."""
        if self.delayed:
            return ()
        return tuple(one.joint for one in self.named
                     if not one.is_of_recorder and one.joint not in self.other_gains)

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
    law, fitted = _other_laws(problem, law, limit, _joints(error > limit), decisions)
    differences = tuple(decisions)
    terms = find_terms(problem, law, limit, fitted.unexplained)
    decisions += [one.describe(problem.joints[one.joint]) for one in terms]
    known = {one.joint for one in terms}
    step, coarse = _encoder_steps(problem)
    return ControllerCheck(
        error, limit, fitted.other_filter, fitted.corners, coarse, step, law, tuple(decisions),
        differences, fitted.other_gains, delayed, fitted.integral, fitted.named, terms,
        tuple(k for k in fitted.unexplained if k not in known), recorded=bool(terms))


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


@dataclasses.dataclass(eq=False)
class _Fitted:
    """What was found at joints whose commands are not those of the stated law."""

    corners: np.ndarray
    other_filter: tuple[int, ...] = ()
    other_gains: tuple[int, ...] = ()
    integral: tuple[float, ...] = ()
    named: tuple[NamedJoint, ...] = ()
    unexplained: tuple[int, ...] = ()


def _other_laws(problem: Problem, stated: StatedLaw, limit: np.ndarray, joints: Sequence[int],
                decisions: list[str]) -> tuple[StatedLaw, _Fitted]:
    """Law that ran at some joints, as far as effects of the catalogue explain their commands."""
    fitted, law = _Fitted(np.full((2, problem.n), np.nan)), stated
    if stated.corners is not None:
        fitted.corners[:] = np.array(stated.corners)[:, None]
    integral = np.zeros(problem.n)
    for k in joints:
        found = explanations(joint_of(problem, stated, k, float(limit[k])))
        also, filtered = _filter_explains(problem, stated, k, float(limit[k]), found)
        if filtered is not None:
            law = law.with_filter(slice(k, k + 1), stated.variant, filtered)
            fitted.other_filter += (k,)
            fitted.corners[:, k] = filtered
            decisions.append(
                f"{problem.joints[k]}: the velocity filter that ran has corners "
                f"{filtered[0]:.0f} and {filtered[1]:.0f} rad/s, not the stated ones")
            continue
        if not found:
            fitted.unexplained += (k,)
            continue
        named = NamedJoint(k, tuple(found), also)
        fitted.named += (named,)
        best, values = found[0], found[0].values
        sentence = named.describe(problem.joints[k])
        if best.name == "gain_error":
            law = with_gain_error(law, k, values.get("kp_error", 0.0), values.get("kd_error", 0.0))
            fitted.other_gains += (k,)
            sentence = describe_gains(problem.joints[k], stated, law, k)
        if best.name == "hidden_integral" and "clamp" not in values:
            integral[k] = values["ki"]
            sentence = describe_integral(problem.joints[k], integral[k])
        decisions.append(sentence)
    fitted.integral = tuple(integral.tolist()) if integral.any() else ()
    return law, fitted


def _filter_explains(problem: Problem, law: StatedLaw, k: int, limit: float,
                     found: Sequence[Found]) -> tuple[tuple[str, ...], tuple[float, float] | None]:
    """Whether corners of the velocity filter explain the commands of joint k.

    As another name for what was found, or by corners in the place of what was found.  A lag of
    the velocity is a corner where no filter is stated, and in a filter it may look like others.
    """
    is_lag = bool(found) and found[0].name == LAG
    if law.corners is None:
        return ((FILTER,) if is_lag else ()), None
    if found and not is_lag and len(found[0].values) == 1:
        return (), None
    corners = _fitted_corners(problem, law, law.corners, k)
    candidate = law.with_filter(slice(k, k + 1), law.variant, corners)
    left = float(_replay_error(problem, candidate)[k])
    if left > limit:
        return (), None
    if not found or left < found[0].left / ALIKE:
        return ((), corners) if not is_lag else ((), None)
    return ((FILTER,) if left <= ALIKE * found[0].left else ()), None


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
