"""A simulator in the place of a model: what differs between it and the robot.

The simulator logged the same experiments.  Its log is diagnosed first: the joint model and the
effects found there are what the simulator already holds.  They become the base of the robot's
diagnosis, with their values as its datasheet, so that a changed number is parametric and only
what the simulator lacks is a cause.  What this base misses of the simulator's own log is taken off
the robot's log, so that to first order only the difference of the two logs counts.

The simulator's log is read no finer than the noise of the robot's sensor, and its loop runs
without noise.  The robot's loop runs with its measured noise, which a simulator seldom has.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.explain import ExplainSteps, explain
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    build_hypothesis,
    held_members,
)
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import Fit, fit
from clie_blocks.analysis.gap.fitting.nominal import with_measured_noise
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.nominal import Nominal
from clie_blocks.analysis.gap.problem.problem import Problem, state_problem
from clie_blocks.analysis.gap.residual.noise import sensor_noise
from clie_blocks.analysis.gap.residual.whitening import residual_model
from clie_blocks.analysis.gap.simulator_comparison.integrator import (
    describe_integrator,
    with_integrator,
)
from clie_blocks.analysis.gap.simulator_comparison.logs import check_motion, with_command
from clie_blocks.analysis.gap.verdict.posterior import posterior
from clie_blocks.analysis.records import Record
from clie_blocks.errors import RecordError

SAME = 1e-3  # largest difference of two references, over their range, that rounding explains
# Relative changes that count as none; of the load, over the RMS torque.
SAME_NUMBER = {"inertia": 0.01, "damping": 0.05, "load": 0.005}
HELD = 0.05  # the same, of the numbers of an effect that the simulator holds
SAME_START = 10.0  # times the noise of the sensor
# Hz, above which an error against the simulator is noise, if it is as small as noise.
SIMULATOR_NOISE = 5.0
MORE = 1.1  # times the noise of the sensor: more than noise
APART = ("joint_elasticity", "backlash")


def against_simulator(problem: Problem, causes: Sequence[Cause], method: Method,
                      steps: ExplainSteps) -> tuple[Problem, tuple[str, ...]]:
    """Return the problem with what the simulator holds as the nominal model.

    The second value says what the simulator holds, a sentence per effect.
    """
    check_clock(problem)
    records = [with_command(record, problem.law) for record in problem.simulated]
    simulated = dataclasses.replace(state_problem(problem.robot, records, held_out=()),
                                    law=problem.law)
    for log in simulated.fit:
        check_motion(log, problem.logs[matched_log(log, problem.logs)], problem.joints)
    best = identify_simulator(with_integrator(with_noise_floor_of(simulated, problem)), causes,
                              method, steps)
    model, half_widths = best.hypothesis, confidence_half_widths(best)
    match = [matching_log(log, simulated.fit) for log in problem.logs]
    logs = [log if j is None else dataclasses.replace(
        log, q=log.q - model.error(j), start=start_of(log, simulated.fit[j], problem))
        for log, j in zip(problem.logs, match)]
    known = {member.name for member in problem.inside}
    inside = tuple(_with_simulator_logs(model, member, match, half_widths)
                   for member in model.members if member.name not in known)
    against = dataclasses.replace(problem, nominal=_nominal(problem, model, half_widths),
                                  inside=(*problem.inside, *inside), quiet=True)
    noisy = with_simulator_noise(without_noise(against), method)
    return (with_positions(noisy, logs),
            (*describe_simulator(model, problem.joints), *describe_integrator(model),
             *reader_decisions(records)))


def with_simulator_noise(problem: Problem, method: Method) -> Problem:
    """Problem whose logs carry the noise of the position, seen against the simulator.

    Noise walks a joint that dry friction holds, and what is missing of it below the usual corner
    leaves the joint elsewhere.  So the corner is low, unless more than noise lies above it: with
    the simulator's parameters or, where less is left then, with refitted ones.
    """
    stated, corner = build_hypothesis(problem, ()), method.fitting.noise_corner
    heard = dataclasses.replace(stated, problem=with_measured_noise(stated, corner))
    refitted = fit(heard, residual_model(heard.problem, heard, method)).hypothesis
    model = min((stated, refitted),
                key=lambda at: noise_ratio(with_measured_noise(at, SIMULATOR_NOISE)))
    noisy = with_measured_noise(model, SIMULATOR_NOISE)
    return noisy if noise_ratio(noisy) < MORE else with_measured_noise(model, corner)


def noise_ratio(problem: Problem) -> float:
    """Largest noise that the logs carry, over that of the sensor."""
    return max(np.std(log.dither[:, k]) / sensor_noise(problem, k)
               for log in problem.logs for k in range(problem.n))


def start_of(log: Log, simulated: Log, problem: Problem) -> np.ndarray:
    """Start of the simulator where it is the robot's but for noise, else the robot's own."""
    noise = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    return np.where(np.abs(simulated.start - log.start) < SAME_START * noise, simulated.start,
                    log.start)


def with_positions(problem: Problem, logs: Sequence[Log]) -> Problem:
    """Problem with the positions and starts of other logs, in the same order."""
    return problem.with_log_list([dataclasses.replace(log, q=other.q, start=other.start)
                                  for log, other in zip(problem.logs, logs)])


def identify_simulator(simulated: Problem, causes: Sequence[Cause], method: Method,
                       steps: ExplainSteps) -> Fit:
    """Fit that says best what a simulator holds."""
    explanation = explain(simulated, causes, method, steps)
    ranking = posterior(explanation.evidence, method.calibration)
    best = next(one.fit for one in ranking if one.fit is not None)
    return best if best.excess < explanation.nominal.excess else explanation.nominal


def confidence_half_widths(best: Fit) -> dict[str, np.ndarray]:
    """95 % half widths of the numbers of a fit, the largest of all logs, by key."""
    at = best.hypothesis
    found: dict[str, np.ndarray] = {}
    for entry, variance in zip(at.free_parameters, np.diag(best.covariance)):
        half = found.setdefault(entry.key, np.zeros(at.problem.n))
        where = slice(None) if entry.joint is None else entry.joint
        half[where] = np.maximum(half[where], 1.96 * np.sqrt(max(variance, 0.0)))
    return found


def with_noise_floor_of(simulated: Problem, problem: Problem) -> Problem:
    """Simulator's problem in which nothing below the robot's own noise matters."""
    quiet = np.array([np.sqrt(12) * sensor_noise(problem, k) for k in range(problem.n)])
    return without_noise(dataclasses.replace(
        simulated, resolution=np.maximum(simulated.resolution, quiet)))


def without_noise(problem: Problem) -> Problem:
    """Problem whose models run without the measured noise."""
    silent = problem.with_logs(lambda log: dataclasses.replace(log, dither=0.0 * log.dither))
    return dataclasses.replace(silent, quiet=True)


def causes_missing_in(causes: Sequence[Cause], problem: Problem) -> tuple[Cause, ...]:
    """Causes that the nominal model of a problem does not hold."""
    held = {member.cause.name for member in held_members(problem)}
    if held & set(APART):
        held |= set(APART)
    return tuple(cause for cause in causes if cause.name not in held)


def matching_log(log: Log, simulated: Sequence[Log]) -> int | None:
    """Place of the simulator's log of the same experiment, or None."""
    for j, other in enumerate(simulated):
        if len(other) == len(log) and distance(log, other) < SAME:
            return j
    return None


def distance(log: Log, other: Log) -> float:
    """Largest difference of set-points and excitations, over their ranges."""
    return max(np.max(np.abs(one - two) / (np.ptp(one, axis=0) + np.ptp(two, axis=0) + 1e-9))
               if np.ptp(one) + np.ptp(two) > 0 else np.max(np.abs(one - two))
               for one, two in ((log.q_d, other.q_d), (log.pe, other.pe)))


def matched_log(log: Log, robots: Sequence[Log]) -> int:
    """Place of the robot's log of the same experiment.

    Raises
    ------
    RecordError
        Says whether its length or its reference differs, and what to do.

    """
    found = matching_log(log, robots)
    if found is not None:
        return found
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
        "simulator with qd and pe of the robot's log, and log both; what lacks counts as at rest")


def check_clock(problem: Problem) -> None:
    """Refuse logs of a simulator on another clock.

    Raises
    ------
    RecordError
        If the sample times differ.

    """
    for record in problem.simulated:
        if abs(record.sample_time - problem.period) > 1e-3 * problem.period:
            raise RecordError(
                f"{record.source}: the simulator logs every {record.sample_time:g} s, the robot "
                f"every {problem.period:g} s; log both at the period of the controller, or bring "
                "one to the clock of the other with clie_blocks.analysis.records.resample")


def reader_decisions(records: Sequence[Record]) -> tuple[str, ...]:
    """Decisions of the reader of a simulator's logs, each once."""
    return tuple(dict.fromkeys(line for record in records for line in record.decisions))


def describe_simulator(model: Hypothesis, joints: Sequence[str]) -> tuple[str, ...]:
    """What a simulator holds, one sentence per effect."""
    return tuple(
        f"the simulator already holds {member.cause.name} at "
        f"{', '.join(joints[k] for k in member.joints)}; a change of its numbers is parametric"
        for member in model.members) or (
        "the simulator's own log shows no effect of the library",)


def _nominal(problem: Problem, model: Hypothesis, half_widths: dict[str, np.ndarray]) -> Nominal:
    """The simulator's joint model, from which the robot's may differ by next to nothing."""
    torque = np.sqrt(np.mean(np.concatenate([log.u for log in problem.logs]) ** 2, axis=0))
    found = {name: model.values[name] for name in SAME_NUMBER}
    scale = {**found, "load": torque}
    return dataclasses.replace(problem.nominal, **found, **{
        f"{name}_tolerance": share * np.abs(scale[name]) + half_widths[name] + 1e-12
        for name, share in SAME_NUMBER.items()})


def _with_simulator_logs(model: Hypothesis, member: Member, match: Sequence[int | None],
                         half_widths: dict[str, np.ndarray]) -> Member:
    """Member with its fitted values, at all joints where it may be, for the robot's logs."""
    values = {number.name: _for_logs(model.values[f"{member.name}.{number.name}"], number, match)
              for number in member.cause.numbers}
    grows = all(number.neutral in (0.0, None) for number in member.cause.numbers)
    joints = tuple(range(model.problem.n)) if grows else member.joints
    sizes = {name: HELD * np.maximum(np.abs(value), np.abs(value).max(initial=1e-12) / 2)
             + half_widths.get(f"{member.name}.{name}", 0.0) for name, value in values.items()}
    return Member(member.cause, joints, values, sizes)


def _for_logs(value: np.ndarray, number: Number, match: Sequence[int | None]) -> np.ndarray:
    """Numbers that differ between logs, in the robot's order; neutral where nothing is known."""
    if number.scope != "log":
        return np.array(value, float)
    idle = np.full(value.shape[1:], 0.0 if number.neutral is None else number.neutral)
    return np.stack([idle if j is None else value[j] for j in match])
