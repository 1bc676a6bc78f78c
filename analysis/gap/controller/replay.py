"""First question to the logs: did the stated controller run?  It needs no model of the robot.

Replaying the law on the measured positions must give the logged command up to its rounding.  If
not, the law with one effect of the catalogue in it may.  The diagnosis then continues with the law
that really ran, so that a wrong description is not mistaken for a fault of the robot.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.found_law import FoundLaw
from clie_blocks.analysis.gap.controller.named import (
    NamedJoint,
)
from clie_blocks.analysis.gap.controller.other_laws import other_laws, replay_error
from clie_blocks.analysis.gap.controller.refit import (
    DELAYED_COMMANDS,
    delayed_replay_error,
    with_command_delay,
    with_command_rounding,
    with_commands_of_law,
    with_law_states,
    without_recorded_excitation,
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
from clie_blocks.analysis.gap.problem.torque_lag import TorqueLag, without_torque_lag
from clie_blocks.analysis.records.law_residual import rounding_limit
from clie_blocks.analysis.records.velocity_filter import discretisations

COARSE_STEP = 1.5  # times the stated step of the encoder: a larger step is another one


@dataclasses.dataclass(frozen=True)
class LawParameter:
    """A parameter of a law that runs as a block, and ran with another value than stated.

    Parameters
    ----------
    name : str
        Its key, with its place in an array.
    joint : int or None
        The joint that it belongs to.
    value, half : float
        What ran, and the half width of what the commands allow.
    stated : float
        What the law's file says.

    """

    name: str
    joint: int | None
    value: float
    half: float
    stated: float


def describe_parameters(changed: Sequence[LawParameter], joints: Sequence[str]) -> tuple[str, ...]:
    """Parameters that ran, and the stated ones, as a sentence per joint."""
    sentences = []
    for joint in dict.fromkeys(one.joint for one in changed):
        values = ", ".join(f"{one.name} {one.value:.4g} (stated {one.stated:.4g})"
                           for one in changed if one.joint == joint)
        where = "" if joint is None else f"{joints[joint]}: "
        sentences.append(f"{where}the law ran with {values}; its description is wrong, or "
                         "somebody changed the controller")
    return tuple(sentences)


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
    parameters : tuple of LawParameter
        Parameters of a law of the user's own that are not the stated ones.
    laws : tuple of FoundLaw
        Laws of the library that ran, at joints where the stated one did not.
    learned : bool
        The file states no law, and these laws are what the logs show.
    followed : tuple of int
        Joints under such a law of which models follow the recorded commands all the same.
    torque_lag : TorqueLag or None
        Of a measured torque that drives the models, behind the positions.

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
    parameters: tuple[LawParameter, ...] = ()
    laws: tuple[FoundLaw, ...] = ()
    learned: bool = False
    followed: tuple[int, ...] = ()
    torque_lag: TorqueLag | None = None

    @property
    def as_stated(self) -> bool:
        """Whether the stated law gives the logged commands."""
        return not (self.misdescribed or self.named or self.terms or self.unexplained)

    @property
    def misdescribed(self) -> bool:
        """Whether the law that ran is known, and another one than is stated."""
        return bool(self.other_filter or self.delayed or self.parameters
                    or (self.laws and not self.learned)
                    or any(not one.is_of_recorder for one in self.named))

    def with_decisions(self, decisions: Sequence[str]) -> "ControllerCheck":
        """The check with further decisions."""
        return dataclasses.replace(self, decisions=(*self.decisions, *decisions))

    def corrected(self, problem: Problem) -> Problem:
        """Problem with the law that ran."""
        if self.torque_lag is not None:
            problem = without_torque_lag(problem, self.torque_lag)
        if self.open_loop:
            return with_unknown_law(problem)
        if self.learned and not self.followed:
            problem = without_recorded_excitation(problem)
        corrected = dataclasses.replace(with_law_states(problem, self.law), law=self.law)
        if self.delayed:
            corrected = with_command_delay(corrected)
        corrected = with_commands_of_law(corrected, {
            one.joint: round(one.found[0].values.get("skew", 0.0) / problem.period)
            for one in self.named if one.is_of_recorder})
        left = (*self.followed_joints, *(self.left_joints if self.recorded else ()))
        return with_command_rounding(with_recorded_commands(corrected, left) if left
                                     else corrected)

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
        return (*(one.joint for one in self.terms), *self.unexplained, *self.followed)


def replay_controller(problem: Problem) -> ControllerCheck:
    """Replay the stated law on every log and correct what of it did not run."""
    law, decisions = problem.stated_law, list[str]()
    limit = rounding_limit(np.concatenate([log.u for log in problem.logs]), law.resolution,
                           problem.resolution * law.position_gain())
    error = replay_error(problem, law)
    if (error > limit).any():
        law, error = _other_discretisation(problem, law, error, limit, decisions)
    delayed_error = delayed_replay_error(problem, law)
    delayed = bool((error > limit).any() and (delayed_error <= limit).all())
    if delayed:
        error = delayed_error
        decisions.append(DELAYED_COMMANDS)
    ran = other_laws(problem, law, limit, _joints(error > limit))
    decisions += ran.decisions
    differences = tuple(decisions)
    terms = find_terms(problem, ran.law, limit, ran.unexplained)
    decisions += [one.describe(problem.joints[one.joint]) for one in terms]
    known = {one.joint for one in terms}
    step, coarse = encoder_steps(problem)
    return ControllerCheck(
        error, limit, tuple(ran.other_filter), ran.corners, coarse, step, ran.law,
        tuple(decisions), differences, tuple(ran.other_gains), delayed,
        tuple(ran.integral.tolist()) if ran.integral.any() else (), tuple(ran.named), terms,
        tuple(k for k in ran.unexplained if k not in known), recorded=bool(terms))


def assume_stated_law(problem: Problem) -> ControllerCheck:
    """Result for a controller that runs more often than any log has samples."""
    law, zero = problem.stated_law, np.zeros(problem.n)
    corners = np.full((2, problem.n), np.nan)
    if law.corners is not None:
        corners[:] = np.array(law.corners)[:, None]
    step, coarse = encoder_steps(problem)
    return ControllerCheck(zero, zero + np.inf, (), corners, coarse, step, law, (
        f"the controller runs every {1e3 * law.period:.3g} ms, more often than the logs have "
        "samples: its law cannot be replayed and is taken as stated",))


def _joints(mask: np.ndarray) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(mask))


def _other_discretisation(problem: Problem, law: StatedLaw, error: np.ndarray, limit: np.ndarray,
                          decisions: list[str]) -> tuple[StatedLaw, np.ndarray]:
    """Law with the discretisation of its filter that ran, and its replay error."""
    if law.corners is None:
        return law, error
    for name in discretisations(law.period, law.corners):
        candidate = law.with_filter(slice(None), name, law.corners)
        candidate_error = replay_error(problem, candidate)
        if (candidate_error <= limit).all() and name != law.variant:
            decisions.append(f"the velocity filter runs as '{name}', not '{law.variant}'; "
                             "no fault of the robot, the robot file is wrong")
            return candidate, candidate_error
    return law, error


def encoder_steps(problem: Problem) -> tuple[np.ndarray, tuple[int, ...]]:
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
