"""Numbers of the robot file that may be wrong, as members of hypotheses, and their fits."""

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.description import (
    CHANGE,
    GEAR_RATIO,
    SIZE,
    numbers_of_coupling,
    ratios_of_inertia,
    stated_numbers,
)
from clie_blocks.analysis.gap.causes.load import COUPLING
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import extended_jacobian, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender, predicted_gain
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import Candidate, fitted_members
from clie_blocks.analysis.gap.search.racing import training_excess

# Effects that a wrong number passes for: they act through the same terms of the model.
_ALIKE = frozenset({"torque_gain_error", "payload", "gravity", "spring"})
_LIKE_COUPLING = frozenset({"payload", COUPLING.name})


def wrong_numbers(problem: Problem) -> list[Member]:
    """Return a member for every number that the robot file states and its model uses."""
    zero, size = np.zeros(problem.n), np.full(problem.n, SIZE)
    return [Member(cause, joints, {CHANGE: zero}, {CHANGE: size})
            for cause, joints in stated_numbers(problem)]


def fit_numbers(members: Sequence[Member], residuals: ResidualModel, nominal: Fit) -> Fit:
    """Return the fit of some members that starts at the stated joint model.

    The refitted one has absorbed much of a wrong number, and leads astray from there.  So a fit
    starts far away, and what it leaves after the first steps says little of where it ends: it is
    continued unless its slopes, too, predict that a hopeless excess is left.
    """
    method = residuals.method.search
    stated = build_hypothesis(residuals.problem, members)
    like = lender(nominal, residuals.method.fitting)
    begun = min((fit(start, residuals, method.first_steps, like)
                 for start in (stated, *_other_ratios(stated, nominal))), key=_cost)
    if predicted_end(begun, residuals, like) > method.hopeless_share * nominal.excess:
        return begun
    return fit(begun.hypothesis, residuals, method.finalist_steps, like)


def _other_ratios(stated: Hypothesis, nominal: Fit) -> Iterator[Hypothesis]:
    """Starts at the gear ratios with which the stated drive has the inertia of the refitted model.

    A command meets the product of inertia and ratio, so that a fit that has the one wrong and the
    other right creeps along a bent valley.
    """
    problem, fitted = stated.problem, nominal.hypothesis.values
    geared = [member for member in stated.members if member.cause.variant == GEAR_RATIO]
    is_off = (np.abs(fitted["inertia"] - problem.nominal.inertia)
              > problem.nominal.inertia_tolerance)
    for member in geared if is_off.any() else ():
        key = f"{member.name}.{CHANGE}"
        at = is_off & np.isin(np.arange(problem.n), member.joints)
        for change in ratios_of_inertia(problem, fitted["inertia"]):
            change = np.where(at, change, 0.0)
            yield stated.with_values({**stated.values, key: change,
                                      "load": fitted["load"] / (1.0 + change)})


def _cost(fit: Fit) -> float:
    return fit.cost


def predicted_end(begun: Fit, residuals: ResidualModel, like: Hypothesis | None) -> float:
    """Excess that the slopes of an unfinished fit predict for its end."""
    gain = predicted_gain(begun.hypothesis, jacobian(begun.hypothesis, residuals, like),
                          residuals.method.fitting)
    return training_excess(begun, gain)


def number_beside(extended: Fit, number: Member, residuals: ResidualModel) -> Candidate:
    """Return the candidate of a number beside the causes of a fit, with its predicted gain."""
    members = (*fitted_members(extended.hypothesis), number)
    start = build_hypothesis(residuals.problem, members, extended.hypothesis)
    tangent = extended_jacobian(start, extended.hypothesis, residuals)
    gain = predicted_gain(start, tangent, residuals.method.fitting)
    return Candidate(members, float(gain), extended)


def with_coupled_number(members: Sequence[Member], problem: Problem,
                        ) -> Iterator[tuple[Member, ...]]:
    """Members of a hypothesis with coupled links, of which a number is wrong, for what is like it.

    A mass at the tip, too, couples the joints that it is carried by.
    """
    one, zero, size = np.ones(problem.n), np.zeros(problem.n), np.full(problem.n, SIZE)
    others = tuple(member for member in members if member.cause.name not in _LIKE_COUPLING)
    coupling = Member(COUPLING, tuple(range(problem.n)), {"share": one}, {"share": one})
    for cause, joints in numbers_of_coupling(problem) if len(others) < len(members) else ():
        yield (*others, coupling, Member(cause, joints, {CHANGE: zero}, {CHANGE: size}))


def with_swapped_number(members: Sequence[Member], numbers: Sequence[Member],
                        ) -> Iterator[tuple[Member, ...]]:
    """Members of a hypothesis with one number of the file in the place of all effects like it."""
    others = tuple(member for member in members if member.cause.name not in _ALIKE)
    if 0 < len(others) < len(members):
        for number in numbers:
            yield (*others, number)
