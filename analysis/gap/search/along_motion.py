"""The search along the measured motion: where a large gap leads free-running models astray.

A model in the stated loop moves as its own causes have it.  Where they explain little of a large
gap, it is elsewhere than the robot: a wave over the position has another phase there, dry friction
changes its sign at other times, and the misfit is full of false minima.  With the recorded
commands and a stiffer feedback, models stay near the measured motion, and what a cause would
explain is nearly what it does.  What is found so is fitted and named in the stated loop.
"""

import dataclasses
import time

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.recorded_commands import has_feedback, with_recorded_commands
from clie_blocks.analysis.gap.method.search import SearchMethod
from clie_blocks.analysis.gap.problem.problem import Problem, holds_stably
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import fitted_members


def following_problem(problem: Problem, method: SearchMethod) -> Problem | None:
    """Problem of models that follow the measured motion more stiffly than the law does.

    None where the law has no such feedback, where models follow recorded commands already, and
    where a stiffer loop is not stable.
    """
    if problem.quiet or not problem.law.holds_joints or not has_feedback(problem):
        return None
    following = with_recorded_commands(problem, method.following_stiffness,
                                       method.following_damping)
    nominal = problem.nominal
    return following if holds_stably(following.law, nominal.inertia, nominal.damping) else None


def within_share_of_time(residuals: ResidualModel, stated: ResidualModel) -> ResidualModel:
    """Residual model along the motion, with its share of the time that the search has left."""
    now, share = time.monotonic(), stated.method.search.following_time
    return dataclasses.replace(residuals, deadline=now + share * (stated.deadline - now))


def in_stated_loop(found: Fit, residuals: ResidualModel) -> Fit:
    """Fit of a set that was found along the measured motion, from there, in the stated loop."""
    start = build_hypothesis(residuals.problem, fitted_members(found.hypothesis),
                             found.hypothesis)
    return fit(start, residuals, residuals.method.search.finalist_steps)
