"""Where the fit of a candidate starts: what was fitted before, and amplitudes that do not harm."""

from collections.abc import Sequence
from typing import Protocol

from clie_blocks.analysis.gap.fitting.compile_ahead import compile_here
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    build_hypothesis,
    costs,
)
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import damped_step, first_lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel


class Startable(Protocol):
    """Causes with parameters from a linear regression, and the fit that they start from."""

    @property
    def members(self) -> tuple[Member, ...]:
        """The causes."""

    @property
    def extends(self) -> Fit | None:
        """The fit whose joint model they start with; None for the refitted nominal model."""


def initial_guess(candidate: Startable, residuals: ResidualModel, nominal: Fit,
                  leader: Fit | None = None) -> Hypothesis:
    """Return the hypothesis of a candidate that a fit starts from.

    It has the joint model of the fit that it extends, or of a `leader` where that does better
    than no cause at all.
    """
    method = residuals.method.fitting
    before = candidate.extends or nominal
    hypothesis = build_hypothesis(residuals.problem, candidate.members, before.hypothesis)
    compile_here(hypothesis)
    fitted_keys = {parameter.key for parameter in before.hypothesis.free_parameters}
    known = {member.name for member in before.hypothesis.members}
    new = [member for member in candidate.members if member.name not in known]
    keeps_all = len(known) + len(new) == len(candidate.members)
    reference = (before if keeps_all else nominal).cost
    like = first_lender(before, residuals)
    if leader is not None:
        hypothesis = with_joint_model(leader, hypothesis, reference, residuals)
    for _ in range(method.joint_model_steps):
        tangent = jacobian(hypothesis, residuals, like)
        if tangent.cost < reference:
            break
        adapted = damped_step(hypothesis, tangent, method, method.cautious_damping, fitted_keys)
        if jacobian(adapted, residuals, like).cost >= tangent.cost:
            break
        hypothesis = adapted
    return shrink_amplitudes(hypothesis, residuals, reference, new, like)


def with_joint_model(leader: Fit, start: Hypothesis, limit: float, residuals: ResidualModel,
                     ) -> Hypothesis:
    """Return a hypothesis with the joint model of a fit, if its cost is below a limit then.

    What a cause leaves to be fitted of the joint model, others like it leave as well.
    """
    values = build_hypothesis(start.problem, (), leader.hypothesis).values
    other = start.with_values({**start.values, **values})
    return other if costs([other], residuals)[0] < limit else start


def shrink_amplitudes(start: Hypothesis, residuals: ResidualModel, reference: float,
                      members: Sequence[Member], like: Hypothesis | None) -> Hypothesis:
    """Return a start with smaller amplitudes of some causes, if it does worse than without them.

    A linear regression may reach too far; `reference` is the cost on the fit logs without the
    causes.
    """
    method = residuals.method.fitting
    amplitudes = {f"{member.name}.{number.name}" for member in members
                  for number in member.cause.numbers
                  if number.neutral == 0.0 and not number.fixed}
    for _ in range(method.shrink_tries):
        if jacobian(start, residuals, like).cost < reference:
            break
        start = start.with_values({
            key: method.shrink_factor * value if key in amplitudes else value
            for key, value in start.values.items()})
    return start
