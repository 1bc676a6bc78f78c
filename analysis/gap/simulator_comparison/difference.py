"""A simulator instead of a datasheet: what differs between it and the robot.

The simulator logged the same experiments.  Its log is diagnosed first: the joint model and the
effects found there are what the simulator already holds.  They become the nominal model of the
robot's diagnosis, with their values as its datasheet.  A changed parameter is then parametric, and
only what the simulator does not have is a cause.  What this model does not explain of the
simulator's own log is subtracted from the robot's log, so that to first order only the difference
of the two logs counts.

The simulator's log is read no finer than the noise of the robot's sensor, and its loop runs
without noise.  The robot's loop runs with its measured noise, which a simulator seldom has.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.explain import ExplainSteps, explain
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    build_hypothesis,
    held_members,
)
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import with_measured_noise
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.nominal import Nominal
from clie_blocks.analysis.gap.problem.problem import Problem, state_problem
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise
from clie_blocks.analysis.gap.residual.whitening import residual_model
from clie_blocks.analysis.gap.simulator_comparison.integrator import (
    describe_integrator,
    with_integrator,
)
from clie_blocks.analysis.gap.simulator_comparison.logs import check_motion, with_command
from clie_blocks.analysis.gap.verdict.posterior import posterior
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.statistical_measures import NORMAL_95
from clie_blocks.errors import RecordError

SAME_EXPERIMENT = 1e-3  # of the range of a reference: a smaller difference is rounding
SAME_PERIOD = 1e-3  # largest relative difference of the sample times of robot and simulator
# Relative changes of the joint model that count as none; of the load, relative to the RMS torque.
SAME_JOINT_MODEL = {"inertia": 0.01, "damping": 0.05, "load": 0.005}
SAME_EFFECT = 0.05  # relative change of the parameters of an effect that counts as none
SAME_START = 10.0  # times the noise of the sensor, between two starts that are the same
# Hz, above which an error against the simulator is noise, if it is as small as noise.
SIMULATOR_NOISE_CORNER = 5.0
LARGEST_NOISE = 1.1  # times the noise of the sensor: a larger error is more than noise
# A simulator with one of them can hold the others.
TWO_BODY_CAUSES = ("joint_elasticity", "backlash", "stiffening_elasticity", "torsional_hysteresis")


def against_simulator(problem: Problem, causes: Sequence[Cause], method: Method,
                      steps: ExplainSteps) -> tuple[Problem, tuple[str, ...]]:
    """Return the problem with what the simulator holds as the nominal model.

    The second value describes what the simulator holds, a sentence per effect.
    """
    check_clock(problem)
    records = [with_command(record, problem.stated_law) for record in problem.simulated]
    simulated = _problem_of_simulator(problem, records)
    best = identify_simulator(with_integrator(with_noise_floor_of(simulated, problem)), causes,
                              method, steps)
    model, half_widths = best.hypothesis, confidence_half_widths(best)
    match = [matching_log(log, simulated.fit) for log in problem.logs]
    held = {member.name for member in problem.inside}
    inside = tuple(_with_robot_logs(model, member, match, half_widths)
                   for member in model.members if member.name not in held)
    against = dataclasses.replace(problem, nominal=_nominal(problem, model, half_widths),
                                  inside=(*problem.inside, *inside), quiet=True)
    noisy = with_simulator_noise(without_noise(against), method)
    logs = [log if j is None else _without_error_of(model, j, log, simulated.fit[j], problem)
            for log, j in zip(problem.logs, match)]
    return (with_positions(noisy, logs),
            (*describe_simulator(model, problem.joints), *describe_integrator(model),
             *reader_decisions(records)))


def _problem_of_simulator(problem: Problem, records: Sequence[Record]) -> Problem:
    """Problem whose robot is the simulator; all of its logs are fitted."""
    if problem.robot is None:
        raise TypeError("a user's loop has no robot file to compare a simulator with")
    simulated = dataclasses.replace(state_problem(problem.robot, records, held_out=()),
                                    law=problem.law)
    for log in simulated.fit:
        check_motion(log, problem.logs[matched_log(log, problem.logs)], problem.joints)
    return simulated


def _without_error_of(model: Hypothesis, j: int, log: Log, simulated: Log, problem: Problem,
                      ) -> Log:
    """Robot's log less what the model of the simulator does not explain of the simulator's."""
    return dataclasses.replace(log, q=log.q - model.error(j),
                               start=start_of(log, simulated, problem))


def with_simulator_noise(problem: Problem, method: Method) -> Problem:
    """Problem whose logs contain the noise of the position, as an error of the simulator.

    Noise moves a joint that dry friction holds; without the noise below the usual corner the model
    of that joint stays at another position.  So the corner is low, unless more than noise lies
    above it: with the simulator's parameters or, where less is left then, with refitted ones.
    """
    stated, corner = build_hypothesis(problem, ()), method.fitting.noise_corner
    peak = method.fitting.loop_peak
    noisy = dataclasses.replace(stated, problem=with_measured_noise(stated, corner, peak))
    refitted = fit(noisy, residual_model(noisy.problem, noisy, method)).hypothesis
    best, ratio = min(((model, _noise_ratio_of(model, peak)) for model in (stated, refitted)),
                      key=lambda pair: pair[1])
    return with_measured_noise(
        best, SIMULATOR_NOISE_CORNER if ratio < LARGEST_NOISE else corner, peak)


def _noise_ratio_of(model: Hypothesis, peak: float) -> float:
    return noise_ratio(with_measured_noise(model, SIMULATOR_NOISE_CORNER, peak))


def noise_ratio(problem: Problem) -> float:
    """Largest noise in the logs, relative to that of the sensor."""
    return max(np.std(log.dither[:, k]) / sensor_noise(problem, k)
               for log in problem.logs for k in range(problem.n))


def start_of(log: Log, simulated: Log, problem: Problem) -> np.ndarray:
    """Start of the simulator where it equals the robot's up to noise, else the robot's own."""
    noise = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    return np.where(np.abs(simulated.start - log.start) < SAME_START * noise, simulated.start,
                    log.start)


def with_positions(problem: Problem, logs: Sequence[Log]) -> Problem:
    """Problem with the positions and starts of other logs, in the same order.

    What was measured beside them goes with them.
    """
    return problem.with_log_list([
        dataclasses.replace(log, q=other.q, start=other.start, of_drive=other.of_drive,
                            drive_rest=other.drive_rest, drive_dither=other.drive_dither)
        for log, other in zip(problem.logs, logs)])


def identify_simulator(simulated: Problem, causes: Sequence[Cause], method: Method,
                       steps: ExplainSteps) -> Fit:
    """Best fit of a simulator's own log, by its probability."""
    explanation = explain(simulated, causes_missing_in(causes, simulated), method, steps)
    ranking = posterior(explanation.evidence, method.calibration)
    best = next(ranked.fit for ranked in ranking if ranked.fit is not None)
    return best if best.excess < explanation.nominal.excess else explanation.nominal


def confidence_half_widths(best: Fit) -> dict[str, np.ndarray]:
    """95 % half widths of the parameters of a fit, the largest of all logs, by key."""
    hypothesis = best.hypothesis
    half_widths: dict[str, np.ndarray] = {}
    for parameter, variance in zip(hypothesis.free_parameters, np.diag(best.covariance)):
        half_width = half_widths.setdefault(parameter.key, np.zeros(hypothesis.problem.n))
        where = slice(None) if parameter.joint is None else parameter.joint
        half_width[where] = np.maximum(half_width[where],
                                       NORMAL_95 * np.sqrt(max(variance, 0.0)))
    return half_widths


def with_noise_floor_of(simulated: Problem, problem: Problem) -> Problem:
    """Simulator's problem with positions read no finer than the noise of the robot's sensor."""
    step = np.array([np.sqrt(12) * sensor_noise(problem, k) for k in range(problem.n)])
    return without_noise(dataclasses.replace(
        simulated, resolution=np.maximum(simulated.resolution, step)))


def without_noise(problem: Problem) -> Problem:
    """Problem whose models run without the measured noise."""
    problem = problem.with_logs(lambda log: dataclasses.replace(
        log, dither=0.0 * log.dither,
        drive_dither=None if log.drive_dither is None else 0.0 * log.drive_dither))
    return dataclasses.replace(problem, quiet=True)


def causes_missing_in(causes: Sequence[Cause], problem: Problem) -> tuple[Cause, ...]:
    """Causes that the nominal model of a problem does not hold."""
    held = {member.cause.name for member in held_members(problem)}
    if held & set(TWO_BODY_CAUSES):
        held |= set(TWO_BODY_CAUSES)
    return tuple(cause for cause in causes if cause.name not in held)


def matching_log(log: Log, simulated: Sequence[Log]) -> int | None:
    """Index of the simulator's log of the same experiment, or None."""
    for j, other in enumerate(simulated):
        if len(other) == len(log) and distance(log, other) < SAME_EXPERIMENT:
            return j
    return None


def distance(log: Log, other: Log) -> float:
    """Largest difference of set-points and excitations, relative to their ranges."""
    return max(_distance(log.q_d, other.q_d),
               _distance(log.pe - log.added, other.pe - other.added))


def _distance(one: np.ndarray, two: np.ndarray) -> float:
    difference, ranges = np.abs(one - two), np.ptp(one, axis=0) + np.ptp(two, axis=0)
    if np.ptp(one) + np.ptp(two) > 0:
        difference = difference / (ranges + 1e-9)
    return float(np.max(difference))


def matched_log(log: Log, robots: Sequence[Log]) -> int:
    """Index of the robot's log of the same experiment.

    Raises
    ------
    RecordError
        Says whether its length or its reference differs, and what to do.

    """
    match = matching_log(log, robots)
    if match is not None:
        return match
    lengths = sorted({len(other) for other in robots})
    if len(log) not in lengths:
        raise RecordError(
            f"{log.name}: the simulator's log has {len(log)} samples, the robot's logs have "
            f"{', '.join(map(str, lengths))}; both must hold the same experiment on the same "
            "clock: log from the same first to the same last sample")
    nearest = min((other for other in robots if len(other) == len(log)),
                  key=lambda other: distance(log, other))
    raise RecordError(
        f"{log.name}: the simulator ran another experiment; its reference or excitation differs "
        f"from that of {nearest.name} by {distance(log, nearest):.1%} of its range. Feed the "
        "simulator with qd and pe of the robot's log, and log both; missing signals are taken as "
        "zero")


def check_clock(problem: Problem) -> None:
    """Refuse logs of a simulator on another clock.

    Raises
    ------
    RecordError
        If the sample times differ.

    """
    for record in problem.simulated:
        if abs(record.sample_time - problem.period) > SAME_PERIOD * problem.period:
            raise RecordError(
                f"{record.source}: the simulator logs every {record.sample_time:g} s, the robot "
                f"every {problem.period:g} s; log both at the period of the controller, or bring "
                "one to the clock of the other with clie_blocks.analysis.records.resample")


def reader_decisions(records: Sequence[Record]) -> tuple[str, ...]:
    """Decisions of the reader of a simulator's logs, each once."""
    return tuple(dict.fromkeys(line for record in records for line in record.decisions))


def describe_simulator(model: Hypothesis, joints: Sequence[str]) -> tuple[str, ...]:
    """Sentence per effect that a simulator holds."""
    return tuple(
        f"the simulator already holds {member.cause.name} at "
        f"{', '.join(joints[k] for k in member.joints)}; a change of its parameters is parametric"
        for member in model.members) or (
        "the simulator's own log shows no effect of the library",)


def _nominal(problem: Problem, model: Hypothesis, half_widths: dict[str, np.ndarray]) -> Nominal:
    """The simulator's joint model, with tolerances of next to nothing."""
    torque = np.sqrt(np.mean(np.concatenate([log.u for log in problem.logs]) ** 2, axis=0))
    values: dict[str, np.ndarray] = {name: model.values[name] for name in SAME_JOINT_MODEL}
    scale = {**values, "load": torque}
    changes: dict[str, Any] = values | {
        f"{name}_tolerance": share * np.abs(scale[name]) + half_widths[name] + 1e-12
        for name, share in SAME_JOINT_MODEL.items()}
    return dataclasses.replace(problem.nominal, **changes)


def _with_robot_logs(model: Hypothesis, member: Member, match: Sequence[int | None],
                     half_widths: dict[str, np.ndarray]) -> Member:
    """Member with its fitted values, at all joints where it may act, for the robot's logs."""
    values = {number.name: _for_logs(model.values[f"{member.name}.{number.name}"], number, match)
              for number in member.cause.numbers}
    neutral_at_zero = all(number.neutral in (0.0, None) for number in member.cause.numbers)
    joints = tuple(range(model.problem.n)) if neutral_at_zero else member.joints
    sizes = {name: _small_change(value) + half_widths.get(f"{member.name}.{name}", 0.0)
             for name, value in values.items()}
    return Member(member.cause, joints, values, sizes)


def _small_change(value: np.ndarray) -> np.ndarray:
    """Change of a parameter that counts as none, per joint."""
    return SAME_EFFECT * np.maximum(np.abs(value), np.abs(value).max(initial=1e-12) / 2)


def _for_logs(value: np.ndarray, number: Number, match: Sequence[int | None]) -> np.ndarray:
    """Parameter that may differ between logs, in the robot's order; neutral in unmatched logs."""
    if number.scope != "log":
        return np.array(value, float)
    neutral = np.full(value.shape[1:], 0.0 if number.neutral is None else number.neutral)
    return np.stack([neutral if j is None else value[j] for j in match])
