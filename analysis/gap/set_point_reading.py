"""Set-points between the rows of a slow log: on a line, or held from row to row.

A servo whose law is unknown runs more often than its log has rows.  Where a computer sends it a
set-point with each row, it holds that until the next one, half a row late in the mean; where the
servo makes the motion itself, its set-points go on between the rows.  The log does not say which,
and the one looks like a delay of the other.  So both are fitted, and held set-points are taken
where they explain more than a line does, and as much as a delay that is free at each joint.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.explain import ExplainSteps
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem, noted
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.posterior import SET_PROBABILITY

HELD = ("The set-points are taken to be held from row to row, as a computer sends them: on a line "
        "between the rows the motion would seem {late:.3g} ms late.")


def read_set_points(problem: Problem, method: Method, steps: ExplainSteps) -> Problem:
    """Return the problem with set-points that are held from row to row, where they are.

    Of a law that a file states, or that was logged with its commands, the line is kept.
    """
    if not _may_be_held(problem):
        return problem
    late = 0.5 * problem.period * (max(log.stride for log in problem.logs) - 1)
    held = problem.with_logs(_with_held_set_points)
    (residuals, line), (_, in_steps) = (
        steps.fit_nominal(with_observer(one, method), method, steps.noise_model)
        for one in (problem, held))
    if in_steps.excess >= line.excess or not _is_likelier(
            in_steps, line, _with_delays(line, residuals, late), method.calibration):
        return problem
    return noted(held, HELD.format(late=1e3 * late))


def _may_be_held(problem: Problem) -> bool:
    """Whether a servo of unknown law follows set-points that move from row to row."""
    stated = problem.statement and problem.statement.robot.controller
    if stated is None or stated.law != "unknown" or not problem.law.holds_joints:
        return False
    return any(not np.array_equal(log.q_d, log.at_samples(log.q_d)) for log in problem.logs)


def _with_held_set_points(log: Log) -> Log:
    return dataclasses.replace(log, q_d=log.at_samples(log.q_d))


def _with_delays(line: Fit, residuals: ResidualModel, late: float) -> Fit:
    """Fit with a delay of its own at each joint [s]."""
    problem = line.hypothesis.problem
    delays = {"delay": np.full(problem.n, late)}
    member = Member(TIME_DELAY, tuple(range(problem.n)), delays, delays)
    return fit(build_hypothesis(problem, (member,), line.hypothesis), residuals)


def _is_likelier(held: Fit, line: Fit, delayed: Fit, calibration: Calibration) -> bool:
    """Whether the odds are for held set-points, before a line and before delays of their own."""
    whole = max(fit.excess for fit in (held, line))
    of_held, of_line, of_delayed = (
        calibration.score(fit.excess, whole) for fit in (held, line, delayed))
    cost = calibration.cause_cost + calibration.parameter_cost
    probability = 1.0 / (1.0 + np.exp(of_line - of_held))
    return bool(probability >= SET_PROBABILITY and of_held > of_delayed - cost)
