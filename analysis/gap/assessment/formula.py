"""A formula of at most five terms for a torque that has no name: chosen, fitted, and tried.

What no cause explains a simulator can still hold.  Terms of place, speed, load and direction are
chosen by what they predict of parts of the logs that took no part in the choice, fitted in closed
loop with the joint model, and judged on unseen data as a cause is.  The formula names no cause
and changes no probability.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.formula_choice import choose
from clie_blocks.analysis.gap.assessment.formula_terms import (
    Term,
    base_responses,
    candidates,
    motions_of,
    responses,
    written,
)
from clie_blocks.analysis.gap.assessment.gap_reduction import GapReduction, gap_reduction
from clie_blocks.analysis.gap.causes.cause import Cause, cause_of
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.residual.noise import rows_of
from clie_blocks.analysis.gap.residual.whitening import DIVERGED, ResidualModel
from clie_blocks.effects.torque_term import TORQUE_TERM

_SHAPES = ("order", "edge", "slowness")  # that a fit moves where a term has them
_HUGE = 1e60  # of what diverges
_FASTEST_FADE = 200.0  # times the inverse of the top speed: below, no log tells it from rest


@dataclasses.dataclass(frozen=True, eq=False)
class Formula:
    """A formula for what a model leaves.

    Parameters
    ----------
    fit : Fit
        The model with the terms as further members, refitted.
    terms : tuple of Member
        Its members that are terms.
    reduction : GapReduction
        What they remove of the reducible gap that the model without them leaves.

    """

    fit: Fit
    terms: tuple[Member, ...]
    reduction: GapReduction

    @property
    def beside(self) -> tuple[str, ...]:
        """Causes that the model holds beside the terms."""
        return tuple(member.cause.name for member in self.fit.hypothesis.members
                     if member not in self.terms)

    def parameters(self, term: Member) -> dict[str, float]:
        """Parameters of one term at its joint."""
        return {number.name: float(
            self.fit.hypothesis.values[f"{term.name}.{number.name}"][term.joints[0]])
            for number in term.cause.numbers}

    def as_dict(self) -> dict[str, Any]:
        """Plain types for the JSON answer; torques oppose the motion, on the motor side."""
        return {"percent": self.reduction.percent, "interval": self.reduction.interval,
                "gap": self.reduction.after, "judged_on": self.reduction.judged_on,
                "beside": list(self.beside),
                "terms": [{"joint": term.joints[0] + 1, "torque": written(self.parameters(term)),
                           "parameters": self.parameters(term)} for term in self.terms]}


def formula_of(hypothesis: Hypothesis, residuals: ResidualModel) -> Formula | None:
    """Return a formula for what a model leaves; None where nothing is left or it does not pay.

    The model is the corrected one, or the refitted nominal one where no cause is believed.
    """
    method, joints = residuals.method.assessment, _with_a_gap(hypothesis, residuals)
    model: Fit | None = None
    for _ in range(0 if residuals.is_out_of_time else method.formula_terms):
        started = hypothesis if model is None else model.hypothesis
        terms = [term for k in joints if (term := _next_term(started, k, method))]
        if not terms:
            break
        better = fit(with_terms(started, terms), residuals, method.formula_steps)
        if better.has_diverged or (model is not None and better.cost >= model.cost):
            break
        model, joints = better, [term.joint for term in terms]
    return None if model is None else _where_it_pays(hypothesis, model, residuals)


def _where_it_pays(hypothesis: Hypothesis, model: Fit, residuals: ResidualModel,
                   ) -> Formula | None:
    """The formula of a model with terms; None where unseen data do not bear it out."""
    reduction = gap_reduction(hypothesis, model.hypothesis, residuals)
    if (reduction.percent is None or not reduction.unseen
            or reduction.percent < residuals.method.assessment.map_least_percent
            or (reduction.interval and reduction.interval[0] < 0.0)):
        return None
    return Formula(model, model.hypothesis.members[len(hypothesis.members):], reduction)


def _with_a_gap(hypothesis: Hypothesis, residuals: ResidualModel) -> list[int]:
    """Joints whose gap on the validation logs is well above the noise."""
    errors = [hypothesis.error(j, dithered=False) for j in validation_logs(hypothesis.problem)]
    left = np.sqrt(np.mean(np.concatenate(errors)**2, axis=0))
    if max(np.abs(error).max() for error in errors) >= DIVERGED:
        return []
    least = residuals.method.assessment.map_least_gap * residuals.floors
    return [int(k) for k in np.flatnonzero(left > least)]


def _next_term(hypothesis: Hypothesis, k: int, method: AssessmentMethod) -> Term | None:
    """The term that describes best what a model leaves at joint k; None where none is worth it.

    Where the linearised loop is unstable it says nothing of what a torque would do.
    """
    problem, values = hypothesis.problem, hypothesis.values
    _, denominator = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    if not np.abs(np.roots(denominator)).max(initial=0.0) < 1.0:
        return None
    logs = range(len(problem.fit))
    motions = [motions_of(hypothesis, j, method)[k] for j in logs]
    left = [_left_at(hypothesis, j, k, method) for j in logs]
    tried = candidates(motions, float(problem.gear_ratio[k]), method)
    columns = [_columns(hypothesis, tried.torques(motion), j, k, method)
               for j, motion in enumerate(motions)]
    if not all(np.abs(some).max(initial=0.0) < _HUGE for some in columns):
        return None
    parts = [_normal_equations(some, error, method) for some, error in zip(columns, left)]
    grams, rights = (np.concatenate(some) for some in zip(*parts))
    base = rights.shape[1] - sum(map(len, tried.groups))
    groups = [tuple(base + i for i in group) for group in tried.groups]
    best, theta, gained = choose(grams, rights, groups, base)
    whole = sum(float(error @ error) for error in left)
    return tried.term(k, best, theta) if gained > method.formula_least_gain * whole else None


def _left_at(hypothesis: Hypothesis, j: int, k: int, method: AssessmentMethod) -> np.ndarray:
    """Error of joint k in log j at the rate of the diagnosis, without the start [rad]."""
    problem = hypothesis.problem
    rows = rows_of(problem.logs[j], problem.period)
    error = rows.of_samples(hypothesis.error(j, dithered=False))[:, k]
    return error[_settled(hypothesis, j, method):]


def _settled(hypothesis: Hypothesis, j: int, method: AssessmentMethod) -> int:
    """Row from which a log is fitted."""
    problem = hypothesis.problem
    return round(method.map_settling / (
        rows_of(problem.logs[j], problem.period).ticks * problem.period))


def _columns(hypothesis: Hypothesis, torques: np.ndarray, j: int, k: int,
             method: AssessmentMethod) -> np.ndarray:
    """What free parameters, then torques, do to joint k in log j, without its start."""
    columns = np.concatenate([base_responses(hypothesis, j, k),
                              responses(hypothesis, torques, j, k)], axis=1)
    return columns[_settled(hypothesis, j, method):]


def _normal_equations(columns: np.ndarray, left: np.ndarray, method: AssessmentMethod,
                      ) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrices and right sides of the parts of a log."""
    parts = list(zip(np.array_split(columns, method.map_parts),
                     np.array_split(left, method.map_parts)))
    return (np.array([some.T @ some for some, _ in parts]),
            np.array([some.T @ part for some, part in parts]))


def with_terms(hypothesis: Hypothesis, terms: Sequence[Term]) -> Hypothesis:
    """Return a hypothesis with further members, one per term, that starts from its values."""
    first = sum(member.cause.name == TORQUE_TERM.name for member in hypothesis.members)
    members = [_member(term, first + place, hypothesis.problem.n)
               for place, term in enumerate(terms)]
    built = build_hypothesis(hypothesis.problem, (*hypothesis.members, *members))
    return built.with_values({**built.values, **hypothesis.values})


def _member(term: Term, place: int, n: int) -> Member:
    values: dict[str, Any] = {p.name: np.full(n, p.default) for p in TORQUE_TERM.parameters
                              if p.of == "effect"}
    for name, value in {**term.shape, **term.amplitudes}.items():
        if name in values:
            values[name][term.joint] = value
    sizes = {name: np.abs(value) * 0.05 for name, value in values.items()}
    scale = 0.05 * max(map(abs, term.amplitudes.values()))
    sizes |= {name: np.full(n, scale) for name in term.amplitudes}
    free = (*term.amplitudes, *(name for name in _SHAPES if term.shape.get(name)))
    slowest = _FASTEST_FADE / term.shape["speed"]
    return Member(_cause(free, place, slowest), (term.joint,), values, sizes)


def _cause(free: tuple[str, ...], place: int, slowest: float) -> Cause:
    """A term as a cause with its own numbers, of which a fit moves some."""
    names = [p.name for p in TORQUE_TERM.parameters if p.of == "effect"]
    return cause_of(TORQUE_TERM, names, lambda scene: [],
                    fixed=[name for name in names if name not in free],
                    within={"slowness": (0.0, slowest)}, variant=str(place + 1))
