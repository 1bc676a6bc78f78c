"""Least squares of a hypothesis in closed loop: simulate, whiten, step, keep what improves.

The residual is the whitened prediction error of all joints and fit logs, freed from the response
to an unknown initial state, with the distances from the datasheet appended.

Why not `scipy.optimize.least_squares`: simulations come in SIMD lanes, 16 runs at hardly the cost
of one.  So all columns of a Jacobian are one batch, and where a step fails, eight dampings are
tried in another; a routine that asks for one run after the other takes several times as long.
The datasheet, too, is no bound of such a routine: inside its tolerance a parameter costs nothing,
beyond it a squared distance.
"""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    FreeParameter,
    Hypothesis,
    costs,
    residuals_of_sets,
)
from clie_blocks.analysis.gap.fitting.jacobian import Tangent, central_jacobian, jacobian
from clie_blocks.analysis.gap.method.fitting import FittingMethod
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.simulation.batch_runs import LANES

__all__ = ["Fit", "damped_step", "first_lender", "fit", "is_long", "lender", "predicted_gain",
           "standard_deviations"]

UNIFORM_PRECISION = 3.0  # inverse variance, in tolerances, of what lies anywhere within its own
TINY = 1e-9
_BOUND_ROUNDS = 8  # of finding the limits and tolerances that a step ends at or beyond


def fit(start: Hypothesis, residuals: ResidualModel, iterations: int | None = None,
        like: Hypothesis | None = None, borrows_only: bool = False) -> Fit:
    """Fit a hypothesis to the fit logs, then evaluate it on all logs.

    Slopes of the joint model and the links may be borrowed from a hypothesis that is `like` the
    start, until a step gains little: until then only the causes are simulated.  There a fit ends
    that `borrows_only`, as the first steps of many that compete.  Where another ends beyond the
    datasheet it continues with central differences: along a flat valley, the curvature in a
    one-sided slope outweighs the datasheet.  By default a fit takes as many steps as the method
    of the residuals says, and none once the time is over.
    """
    method = residuals.method.fitting
    hypothesis, tangent = start, jacobian(start, residuals, like)
    damping, kept, two_sided, cautious = method.least_damping, 0, False, False
    for _ in range(method.iterations if iterations is None else iterations):
        if residuals.is_out_of_time:
            break
        step = _improving_step(hypothesis, tangent, residuals, damping, cautious, like)
        if step is not None:
            hypothesis, damping, cautious = step
            kept += 1
        after = jacobian(hypothesis, residuals, like)
        if step is None or tangent.cost - after.cost < _least_gain(after, method):
            violation = after.prior_violation
            if borrows_only:
                break
            if like is not None:
                like, after = None, jacobian(hypothesis, residuals)
            elif two_sided or violation @ violation < method.two_sided_violation:
                break
            else:
                two_sided = True
            damping = method.least_damping
        tangent = central_jacobian(hypothesis, residuals) if two_sided else after
    return _evaluated(hypothesis, residuals, kept, like)


def lender(fit: Fit, method: FittingMethod) -> Hypothesis | None:
    """Hypothesis whose slopes other fits may borrow until they end; None beyond the datasheet.

    A joint model that has absorbed what its hypothesis lacks is far from there.
    """
    violation = fit.prior_violation
    return fit.hypothesis if violation @ violation < method.two_sided_violation else None


def first_lender(fit: Fit, residuals: ResidualModel) -> Hypothesis | None:
    """Hypothesis whose slopes the first steps of other fits may borrow.

    On an arm of many joints it is that of a fit whatever it absorbed: slopes of their own would
    take most of the time, and what is only compared with others can do without.
    """
    return fit.hypothesis if is_long(residuals) else lender(fit, residuals.method.fitting)


def is_long(residuals: ResidualModel) -> bool:
    """Whether the robot has so many joints that its fits take long."""
    return residuals.method.fitting.is_long(residuals.problem.n)


def _least_gain(tangent: Tangent, method: FittingMethod) -> float:
    """Gain of a step that ends a fit."""
    return method.converged_gain * len(tangent.residual) + method.converged_share * tangent.cost


class _Step(NamedTuple):
    """A step that improves, the damping of the next one, and whether that is likely to fail."""

    hypothesis: Hypothesis
    damping: float
    cautious: bool


def _improving_step(hypothesis: Hypothesis, tangent: Tangent, residuals: ResidualModel,
                    damping: float, cautious: bool, like: Hypothesis | None = None,
                    ) -> _Step | None:
    """Step that improves; None if there is none worth it.

    If the first step fails, many with more damping are simulated side by side.  The next first
    step is likely to fail as well: a cautious fit tries it among them, and takes no slopes there.
    """
    method = residuals.method.fitting
    if predicted_gain(hypothesis, tangent, method) < (
            method.skipped_gain * _least_gain(tangent, method)):
        return None
    first = damped_step(hypothesis, tangent, method, damping)
    after_first = _Step(first, max(damping / 10, method.least_damping), False)
    if not cautious and jacobian(first, residuals, like).cost < tangent.cost:
        return after_first
    factors = np.array(method.retry_factors)[:LANES - cautious]  # one group of runs
    dampings = max(damping, method.cautious_damping) * factors
    proposals = [damped_step(hypothesis, tangent, method, more) for more in dampings]
    reached = costs([first, *proposals] if cautious else proposals, residuals)
    if cautious and reached[0] < tangent.cost:
        return after_first
    reached = reached[-len(proposals):]
    best = int(np.argmin(reached))
    if reached[best] < tangent.cost:
        return _Step(proposals[best], dampings[best] / 10, True)
    return None


def _evaluated(hypothesis: Hypothesis, residuals: ResidualModel, kept: int,
               like: Hypothesis | None) -> Fit:
    """Fit of a hypothesis as it stands."""
    problem, tangent = hypothesis.problem, jacobian(hypothesis, residuals, like)
    held_out = [part[0] for of_log in residuals_of_sets(
        hypothesis, [hypothesis.values], residuals, range(len(problem.fit), len(problem.logs)))
        for part in of_log]
    parts, shape = [*tangent.parts, *held_out], (len(problem.logs), problem.n)
    chi2 = np.reshape([part @ part for part in parts], shape)
    samples = np.reshape([residuals.samples(part, *divmod(i, problem.n))
                          for i, part in enumerate(parts)], shape)
    sizes = np.array([parameter.size for parameter in hypothesis.free_parameters])
    covariance = np.linalg.pinv(tangent.information, hermitian=True)
    spread = standard_deviations(hypothesis.free_parameters, tangent.normal[0],
                                 chi2.sum() / samples.sum())
    return Fit(hypothesis, chi2, samples, tangent.prior_violation,
               covariance * np.outer(sizes, sizes), spread, kept)


def damped_step(hypothesis: Hypothesis, tangent: Tangent, method: FittingMethod, damping: float,
                keys: Collection[str] | None = None, inner_weight: float = 0.0) -> Hypothesis:
    """Hypothesis after a damped Gauss-Newton step.

    Parameters
    ----------
    hypothesis : Hypothesis
        Where the step starts.
    tangent : Tangent
        Its slopes.
    method : FittingMethod
        How far a step may go.
    damping : float
        Levenberg's, relative to the squares of the columns.
    keys : collection of str, optional
        Parameters that may move; all by default.
    inner_weight : float
        What draws a parameter to its stated value inside its tolerance, see `_best_change`.

    """
    parameters = hypothesis.free_parameters
    used = [i for i, parameter in enumerate(parameters) if keys is None or parameter.key in keys]
    limits = [_limits(parameters[i], hypothesis.get(parameters[i]), method) for i in used]
    change = _best_change(hypothesis, tangent, used, limits, method, damping, inner_weight)
    return hypothesis.with_values(hypothesis.moved(
        [(parameters[i], float(np.clip(
            hypothesis.get(parameters[i]) + share * parameters[i].size, *limit)))
         for i, share, limit in zip(used, change, limits)]))


def _limits(parameter: FreeParameter, value: float, method: FittingMethod,
            ) -> tuple[float, float]:
    """Least and largest value after a step: its reach, inside the bounds."""
    reach = method.step_reach * max(abs(value), parameter.size)
    least, most = value - reach, value + reach
    if parameter.is_scale and value > 0.0:
        least = max(least, value / method.scale_step_factor)
        most = min(most, method.scale_step_factor * value)
    return max(least, parameter.lower), min(most, parameter.upper)


def _best_change(hypothesis: Hypothesis, tangent: Tangent, used: Sequence[int],
                 limits: Sequence[tuple[float, float]], method: FittingMethod, damping: float,
                 inner_weight: float = 0.0) -> np.ndarray:
    """Best change of each used parameter, over its size, within limits and the datasheet.

    A parameter that would pass its limits ends there, and the others take the step that is best
    beside it.  What a datasheet allows costs nothing, so its bound counts where the step ends
    beyond it; or it costs `inner_weight` times its squared distance from the stated value, in
    tolerances, and from the bound on that cost grows no faster.
    """
    gram, right = tangent.normal
    gram, right = gram[np.ix_(used, used)], right[used]
    parameters = [hypothesis.free_parameters[i] for i in used]
    size, value = (np.array(column) for column in zip(*(
        (parameter.size, hypothesis.get(parameter)) for parameter in parameters)))
    centre, allowed = np.array([(parameter.centre or 0.0, parameter.tolerance or np.inf)
                                for parameter in parameters]).T
    softness = method.prior_softness
    side = np.sign(hypothesis.prior_violations(softness)[used])
    least, most = (np.array(limits).T - value) / size
    change, free = np.zeros(len(used)), np.full(len(used), True)
    for _ in range(_BOUND_ROUNDS):
        weight = np.where(side == 0.0, np.sqrt(inner_weight), 1.0 / softness)
        slope = weight * size / allowed
        bound = side * (1.0 - inner_weight * softness**2)
        beyond = weight * ((value - centre) / allowed - bound)
        normal = gram + np.diag(slope**2)
        scale = np.sqrt(np.diag(normal)) + 1e-12
        normal = normal / np.outer(scale, scale) + damping * np.eye(len(scale))
        goal = -(right + slope * beyond) / scale - normal[:, ~free] @ (change * scale)[~free]
        change[free] = np.linalg.solve(normal[np.ix_(free, free)], goal[free]) / scale[free]
        z = (value + change * size - centre) / allowed
        ended = np.sign(z) * (np.abs(z) > 1.0)
        within = (least <= change) & (change <= most)
        if (ended == side).all() and within.all():
            break
        side, free, change = ended, free & within, np.clip(change, least, most)
    return change


def predicted_gain(hypothesis: Hypothesis, tangent: Tangent, method: FittingMethod) -> float:
    """Gain that the slopes of a hypothesis predict, were a step of any reach within the bounds."""
    parameters = hypothesis.free_parameters
    bounds = [(parameter.lower, parameter.upper) for parameter in parameters]
    change = _best_change(hypothesis, tangent, range(len(parameters)), bounds, method,
                          method.least_damping)
    gram, right = tangent.normal
    before, after = tangent.prior_violation, [
        parameter.violation(hypothesis.get(parameter) + share * parameter.size,
                            method.prior_softness)
        for parameter, share in zip(parameters, change)]
    return -change @ (2 * right + gram @ change) + before @ before - np.dot(after, after)


def standard_deviations(parameters: Sequence[FreeParameter], gram: np.ndarray, misfit: float,
                        ) -> np.ndarray:
    """Standard deviation of each parameter, whatever the others are.

    `gram` is that of the columns of the logs, per size of each parameter, and `misfit` the chi^2
    per sample, by which the logs determine less than their noise would allow.
    """
    size, allowed = np.array([(parameter.size, parameter.tolerance or np.inf)
                              for parameter in parameters]).T
    precision = gram / max(misfit, 1.0) + UNIFORM_PRECISION * np.diag((size / allowed)**2)
    scale = np.sqrt(np.diag(precision)) + TINY
    inverse = np.linalg.inv(precision / np.outer(scale, scale) + TINY * np.eye(len(scale)))
    return np.sqrt(np.diag(inverse)) / scale * size
