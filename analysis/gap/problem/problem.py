"""What is to be explained: logs of one robot, and everything that is known of it.

All torques are motor side [N m], all angles joint side [rad].
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self

import numpy as np

from clie_blocks.analysis.gap.problem.held_out_logs import (
    held_out_logs,
    held_out_of_free,
    split_logs,
)
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.locked_output import LockedError, Twist, is_locked, twists
from clie_blocks.analysis.gap.problem.log import LEAST_SAMPLES, Log, as_logs
from clie_blocks.analysis.gap.problem.nominal import Nominal, nominal_model, stated_or
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.gap.problem.preparation import prepare
from clie_blocks.analysis.gap.problem.simulated_logs import complete
from clie_blocks.analysis.gap.problem.stated_law import pose_of, stated_law, with_start_state
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.gap.problem.ticks import FINEST_PERIOD, controller_period
from clie_blocks.analysis.gap.problem.user_loop.statement import loop_statement
from clie_blocks.analysis.gap.problem.what_u_is import LAW_TOO_FAST, without_law
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks import Finding
from clie_blocks.analysis.records.controller_section import COMMANDED
from clie_blocks.analysis.records.corrections import Correction, Examination, examine
from clie_blocks.analysis.records.robot import with_law
from clie_blocks.analysis.records.two_encoders import with_law_encoder
from clie_blocks.errors import ClieError, NotIdentifiableError
from clie_blocks.robot_loop.links import Links, mass_rows

if TYPE_CHECKING:
    from control import InputOutputSystem


_POSE_SPACING = 50  # samples of a log between two poses
STABLE = 1.001  # largest pole of a sampled loop that counts as stable, with errors of rounding


class HeldEffect(Protocol):
    """An effect that the nominal model holds, with the parameters that it has there."""

    @property
    def name(self) -> str:
        """Name of the effect."""

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints that have it."""

    @property
    def values(self) -> Mapping[str, np.ndarray]:
        """Parameter -> value per joint, shape (n,)."""


class Statement(NamedTuple):
    """Robot and logs before preparation, and which logs are held out."""

    robot: Robot
    records: tuple[Record, ...]
    held_out: tuple[int, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """Logs, law, nominal model and known link terms of one robot.

    Parameters
    ----------
    fit, held_out : tuple of Log
        Logs that models are fitted to, and logs for validation only.
    law : Law
        The control law.
    nominal : Nominal
        The stated joint model.
    links : Links
        The links.
    gear_ratio, shaft_ratio : ndarray, shape (n,)
        Motor turns and encoder-shaft turns per joint turn.
    resolution : ndarray, shape (n,)
        Stated step of the logged position [rad], 0 when not stated.
    joints : tuple of str
        Names.
    inside : tuple of HeldEffect
        Effects that the nominal model holds in addition to its joint model.
    command_delay : float
        Delay between the computation of a command and its effect, as the logs show [s].
    quiet : bool
        Models run without the measured noise, as a user's simulator does.
    records : tuple of Record
        The robot's logs, in the form of eq. (11).
    simulated : tuple of Record
        Logs of the user's own simulator in the same experiments, see `beside`.
    robot : Robot or None
        What is known of the robot, in the form of eq. (11); None of a loop.
    statement : Statement or None
        Robot and logs before preparation; None of a loop.
    corrections : tuple of Correction
        What was corrected in the logs before anything else.
    log_warnings : tuple of Finding
        What the checks of the logs found and could not correct.
    two_encoders : bool
        Models predict what both encoders of a joint see, see `two_encoders`.
    twists : tuple of Twist
        Of gears, from logs in which the output was locked; no model of the motion sees these.

    """

    fit: tuple[Log, ...]
    held_out: tuple[Log, ...]
    law: Law
    nominal: Nominal
    links: Links
    gear_ratio: np.ndarray
    shaft_ratio: np.ndarray
    resolution: np.ndarray
    joints: tuple[str, ...]
    inside: tuple[HeldEffect, ...] = ()
    command_delay: float = 0.0
    quiet: bool = False
    records: tuple[Record, ...] = ()
    simulated: tuple[Record, ...] = ()
    robot: Robot | None = None
    statement: Statement | None = None
    corrections: tuple[Correction, ...] = ()
    log_warnings: tuple[Finding, ...] = ()
    two_encoders: bool = False
    twists: tuple[Twist, ...] = ()

    def __repr__(self) -> str:
        logs = (*self.fit, *self.held_out)
        return (f"Problem(joints {', '.join(self.joints)}; {len(logs)} logs, "
                f"{sum(map(len, logs))} samples of {self.period:g} s; "
                f"{len(self.held_out)} held out)")

    @classmethod
    def from_logs(cls, robot: Robot, records: Sequence[Record],
                  held_out: Sequence[int] | None = None, trust_logs: bool = False,
                  law: InputOutputSystem | None = None) -> Problem:
        """State the problem of a robot and its logs.

        Parameters
        ----------
        robot : Robot
            What is known.
        records : sequence of Record
            Its logs.
        held_out : sequence of int, optional
            Logs for validation only; by default the last, when there are two or more.
        trust_logs : bool
            Take the logs as they are: correct nothing in them, and stop for nothing.
        law : control.InputOutputSystem, optional
            The control law as a block in discrete time, in place of that of the robot file:
            inputs q_d[k], q[k] [rad] and, if it takes them, pe[k], dq[k] [rad/s] and tau[k];
            outputs u[k], as logged.

        Raises
        ------
        RecordError
            If a signal is missing from a record, the logs do not belong together, or they are
            not what they seem to be and do not show what would be right.
        NotIdentifiableError
            If a log is too short, or nothing says what drove the machine.
        LockedError
            If the output was locked in all logs.

        """
        robot = robot if law is None else with_law(robot, law)
        locked = tuple(itertools.chain.from_iterable(
            twists(record) for record in records if is_locked(record, robot)))
        held_out = held_out_of_free(robot, records, held_out)
        records = [record for record in records if not is_locked(record, robot)]
        if locked and not records:
            raise LockedError(locked)
        records = with_law_encoder(records, robot)
        seen = Examination(robot, tuple(records)) if trust_logs else examine(records, robot)
        seen.raise_obstacles()
        prepared_robot, prepared = prepare(robot, list(seen.records))
        problem = state_problem(prepared_robot, prepared, held_out)
        return dataclasses.replace(
            problem, statement=Statement(robot, seen.records, held_out_logs(records, held_out)),
            corrections=seen.corrections, log_warnings=seen.warnings, twists=locked)

    @classmethod
    def from_loop(cls, loop: InputOutputSystem, records: Record | Sequence[Record],
                  held_out: Sequence[int] | None = None) -> Problem:
        """State the problem of any python-control loop and its logs.

        Parameters
        ----------
        loop : control.InputOutputSystem
            The user's model, with inputs ``q_d`` and ``torque``, outputs ``q`` and ``u``; the
            report of a missing port says how to add it.
        records : Record or sequence of Record
            Logs on one time grid each.
        held_out : sequence of int, optional
            Logs for validation only; by default the last, when there are two or more.

        Raises
        ------
        ClieError
            If a port of the loop is missing, the loop fails, or its sample time is not that of
            the logs.
        DivergedError
            If the loop is unstable.

        """
        records = [records] if isinstance(records, Record) else list(records)
        robot, law, nominal, logs = loop_statement(loop, records)
        one = np.ones(robot.n)
        fit, validation = split_logs(logs, held_out_logs(records, held_out))
        return cls(fit, validation, law, nominal, law.links, one, one, 0 * one,
                   tuple(robot.joints), quiet=True, records=tuple(records))

    def beside(self, simulated: Sequence[Record]) -> Problem:
        """Return the problem of what differs between the robot and the user's own simulator.

        Parameters
        ----------
        simulated : sequence of Record
            Logs of the simulator in the same experiments.

        Raises
        ------
        ClieError
            If the problem is that of a loop, whose model is the loop itself.

        """
        if self.statement is None:
            raise ClieError("a loop is its own simulator; compare a simulator with the logs of a "
                            "robot file: Problem.from_logs(robot, records).beside(simulated)")
        robot, records, held_out = self.statement
        logs = [complete(record, j, records) for j, record in enumerate(simulated)]
        prepared_robot, prepared = prepare(robot, [*records, *with_law_encoder(logs, robot)])
        problem = state_problem(prepared_robot, prepared[:len(records)], held_out)
        return dataclasses.replace(problem, statement=self.statement,
                                   simulated=tuple(prepared[len(records):]),
                                   corrections=self.corrections, log_warnings=self.log_warnings)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def period(self) -> float:
        """Sample time of the controller and the logs [s]."""
        return self.law.period

    @property
    def encoder_on_motor(self) -> bool:
        """Whether the encoder sits before the gear, where it sees the motor and not the link."""
        return self.robot is not None and self.robot.encoder.mounting == "motor side"

    @property
    def stated_law(self) -> StatedLaw:
        """The law that a robot file states, for stages that replay or change it."""
        if not isinstance(self.law, StatedLaw):
            raise TypeError("a user's loop states no law; its controller is part of the loop")
        return self.law

    @property
    def logs(self) -> tuple[Log, ...]:
        """All logs, those that models are fitted to first."""
        return self.fit + self.held_out

    @functools.cached_property
    def mass_coupling(self) -> float:
        """Largest mass that two joints share, over the root of their own; 0 without links."""
        if not self.links.known or self.n < 2:
            return 0.0
        q = np.concatenate([log.q[::_POSE_SPACING] for log in self.logs])
        rows = mass_rows(self.links, q)
        of_rotors = self.gear_ratio * self.nominal.inertia - self.links.diagonal
        own = [rows[k][k] + of_rotors[k] for k in range(self.n)]
        return max(float(np.abs(rows[j][k] / np.sqrt(own[j] * own[k])).max())
                   for j in range(self.n) for k in range(j))

    @functools.cached_property
    def rms_command(self) -> np.ndarray:
        """RMS of the commands of the fitted logs [N m], shape (n,)."""
        u = np.nan_to_num(np.concatenate([log.u for log in self.fit]))
        return np.asarray(np.sqrt(np.mean(u**2, axis=0)))

    @functools.cached_property
    def runs(self) -> tuple[int, ...]:
        """Run of each log, from 0: of two views of one run it is the same."""
        return tuple(itertools.accumulate(
            (not log.of_other_encoder for log in self.logs[1:]), initial=0))

    @property
    def law_logs(self) -> tuple[Log, ...]:
        """Logs of the encoder on which the law acts: one per run."""
        return tuple(log for log in self.logs if not log.of_other_encoder)

    @property
    def fit_runs(self) -> int:
        """Number of runs to fit."""
        return self.runs[len(self.fit) - 1] + 1

    def with_logs(self, change: Callable[[Log], Log]) -> Self:
        """Return the problem with every log as a function returns it."""
        return self.with_log_list([change(log) for log in self.logs])

    def with_log_list(self, logs: Sequence[Log]) -> Self:
        """Return the problem with other logs, in the order of `Problem.logs`."""
        count = len(self.fit)
        return dataclasses.replace(self, fit=tuple(logs[:count]), held_out=tuple(logs[count:]))


def state_problem(robot: Robot, records: Sequence[Record],
                  held_out: Sequence[int] | None = None) -> Problem:
    """State the problem of a robot and its records, both in the form of eq. (11)."""
    period = controller_period(robot.controller, records)
    problem = _problem_at(robot, records, held_out, period)
    if _is_too_fast(problem, robot, records):
        robot, records = prepare(*without_law(robot, records, COMMANDED, LAW_TOO_FAST))
        return _problem_at(robot, records, held_out, controller_period(robot.controller, records))
    finest = max(robot.controller.sample_time or 0.0, FINEST_PERIOD)
    if is_stable(problem) or period <= finest or robot.controller.is_block:
        return problem
    while period > finest:
        period = max(period / 2, finest)
        faster = _problem_at(robot, records, held_out, period)
        if is_stable(faster):
            return noted(faster, f"The loop would be unstable at the rate of the log: its "
                         f"controller is taken to run every {1e3 * period:.3g} ms.")
    return problem


def _is_too_fast(problem: Problem, robot: Robot, records: Sequence[Record]) -> bool:
    """Whether a loop acts within one sample of its logs, so that these hardly show its errors.

    Sampled at their rate it would be unstable.  Without recorded commands there is no other way.
    """
    if (not problem.law.holds_joints or any(log.shows_every_tick for log in problem.logs)
            or any(record.u is None for record in records)):
        return False
    logged = min(record.sample_time for record in records)
    law = stated_law(robot, logged, pose_of(robot, records[0]), problem.links,
                      problem.gear_ratio)
    return not is_stable(dataclasses.replace(problem, law=law))


def noted(problem: Problem, sentence: str) -> Problem:
    """Return the problem with a decision noted in its records."""
    return dataclasses.replace(
        problem, records=tuple(record.noted(sentence) for record in problem.records))


def is_stable(problem: Problem) -> bool:
    """Whether the stated loop is stable with the stated joint model, sampled as it is."""
    return holds_stably(problem.law, problem.nominal.inertia, problem.nominal.damping)


def holds_stably(law: Law, inertia: np.ndarray, damping: np.ndarray) -> bool:
    """Whether the linearised loop of each joint is stable, if there is one."""
    return not law.holds_joints or all(
        np.abs(np.roots(law.torque_sensitivity(k, *joint)[1])).max() < STABLE
        for k, joint in enumerate(zip(inertia, damping)))


def _problem_at(robot: Robot, records: Sequence[Record], held_out: Sequence[int] | None,
                period: float) -> Problem:
    """Problem whose controller has a period [s]."""
    links = stated_links(robot, pose_of(robot, records[0]))
    ratio = stated_or(robot.motor.gear_ratio, robot.n, 1.0)
    law = stated_law(robot, period, pose_of(robot, records[0]), links, ratio)
    by_record = [[with_start_state(log, law) for log in as_logs(record, robot, k, law.period)]
                 for k, record in enumerate(records)]
    logs = [log for pieces in by_record for log in pieces]
    if any(log.supply is None for log in logs):  # one program runs all logs
        by_record = [[dataclasses.replace(log, supply=None) for log in pieces]
                     for pieces in by_record]
        logs = [log for pieces in by_record for log in pieces]
    shortest = min(logs, key=Log.sample_count)
    if shortest.sample_count() < LEAST_SAMPLES:
        raise NotIdentifiableError(
            f"{shortest.name} has {shortest.sample_count()} samples; a diagnosis needs at "
            f"least {LEAST_SAMPLES} per log, better 20 s of motion: record longer")
    fit, validation = split_logs(by_record, held_out_logs(records, held_out))
    return _linearised_where_stable(Problem(
        fit, validation, law, nominal_model(robot, links, ratio, logs, law.period), links,
        gear_ratio=ratio, shaft_ratio=stated_or(robot.encoder.shaft_ratio, robot.n, 1.0),
        resolution=stated_or(robot.encoder.resolution, robot.n, 0.0), joints=tuple(robot.joints),
        records=tuple(records), robot=robot))


def _linearised_where_stable(problem: Problem) -> Problem:
    """Problem whose law, if it pushes the joints along near rest, is linearised over motions.

    A dry friction that the law carries by the direction of a velocity is steep at rest, where it
    would be unstable without the friction.
    """
    if not isinstance(problem.law, BlockLaw) or is_stable(problem):
        return problem
    over_motions = dataclasses.replace(problem, law=problem.law.over_motions())
    return over_motions if is_stable(over_motions) else problem


