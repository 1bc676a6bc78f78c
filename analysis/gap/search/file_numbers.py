"""Numbers of the robot file that may be wrong, as members of hypotheses, and their fits."""

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.description import (
    CHANGE,
    GEAR_RATIO,
    SIZE,
    ratio_of_same_inertia,
    stated_numbers,
)
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, predicted_gain
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import Candidate, fitted_members
from clie_blocks.analysis.gap.search.racing import training_excess

# Effects that a wrong number passes for: they act through the same terms of the model.
_ALIKE = frozenset({"torque_gain_error", "payload", "gravity", "spring"})


def wrong_numbers(problem: Problem) -> list[Member]:
    """Return a member for every number that the robot file states and its model uses."""
    zero, size = np.zeros(problem.n), np.full(problem.n, SIZE)
    return [Member(cause, joints, {CHANGE: zero}, {CHANGE: size})
            for cause, joints in stated_numbers(problem)]


def fit_numbers(members: Sequence[Member], residuals: ResidualModel, hopeless: float) -> Fit:
    """Return the fit of some members that starts at the stated joint model.

    The refitted one has absorbed much of a wrong number, and leads astray from there.  So a fit
    starts far away, and what it leaves after the first steps says little of where it ends: it is
    continued unless its slopes, too, predict that a hopeless excess is left.
    """
    method = residuals.method.search
    begun = fit(build_hypothesis(residuals.problem, members), residuals, method.first_steps)
    if predicted_end(begun, residuals) > hopeless:
        return begun
    found = fit(begun.hypothesis, residuals, method.finalist_steps)
    return min((found, *_other_ratios(found, residuals)), key=lambda one: one.total)


def _other_ratios(found: Fit, residuals: ResidualModel) -> Iterator[Fit]:
    """Fit from the other ratio that gives the joint its inertia, where a gear ratio is not right.

    The stated ratio may lie on the wrong side of both.
    """
    is_right = (found.excess < residuals.method.calibration.healthy
                and found.penalty <= residuals.method.verdict.prior_violation)
    geared = [member for member in found.hypothesis.members
              if member.cause.variant == GEAR_RATIO]
    if is_right or not geared or not residuals.problem.chain.known:
        return
    key = f"{geared[0].name}.{CHANGE}"
    change = found.hypothesis.values[key]
    k = int(np.argmax(np.abs(change)))
    other = np.where(np.arange(len(change)) == k,
                     ratio_of_same_inertia(residuals.problem, change), change)
    yield fit(found.hypothesis.with_values({**found.hypothesis.values, key: other}), residuals,
              residuals.method.search.finalist_steps)


def predicted_end(begun: Fit, residuals: ResidualModel) -> float:
    """Excess that the slopes of an unfinished fit predict for its end."""
    gain = predicted_gain(begun.hypothesis, jacobian(begun.hypothesis, residuals),
                          residuals.method.fitting)
    return training_excess(begun, gain)


def number_beside(extended: Fit, number: Member, residuals: ResidualModel) -> Candidate:
    """Return the candidate of a number beside the causes of a fit, with its predicted gain."""
    members = (*fitted_members(extended.hypothesis), number)
    start = build_hypothesis(residuals.problem, members, extended.hypothesis)
    gain = predicted_gain(start, jacobian(start, residuals), residuals.method.fitting)
    return Candidate(members, float(gain), extended)


def with_swapped_number(members: Sequence[Member], numbers: Sequence[Member],
                        ) -> Iterator[tuple[Member, ...]]:
    """Members of a hypothesis with one number of the file in the place of all effects like it."""
    others = tuple(member for member in members if member.cause.name not in _ALIKE)
    if 0 < len(others) < len(members):
        for number in numbers:
            yield (*others, number)
