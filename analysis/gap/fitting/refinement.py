"""MAP refinement of a finished fit: parameters that the logs leave open, joints that do nothing.

Where the logs determine two parameters only together, as a gain of the drive and the inertia, a
fit ends anywhere in the range that the tolerances allow.  What lies anywhere within its tolerance
has a mean, the stated value, and a variance, so that one more step ends where the parameters are
expected.  What the logs determine, it leaves.
"""

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.cache import FitCache
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, chi2_by_joint
from clie_blocks.analysis.gap.fitting.jacobian import Tangent, central_jacobian, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import (
    TINY,
    UNIFORM_PRECISION,
    Fit,
    damped_step,
    fit,
    predicted_gain,
    standard_deviations,
)
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

_STEP_SHARES = 2.0 ** -np.arange(7)  # of a step, that are tried side by side


def refine_to_prior(fit: Fit, residuals: ResidualModel) -> Fit:
    """Return a fit with its parameters where logs and datasheet expect them, and their spread."""
    method = residuals.method.fitting
    for _ in range(method.refinement_rounds):
        fit, gain = _nearer_to_prior(fit, residuals)
        if gain < method.refinement_gain:
            break
    return fit


def _nearer_to_prior(fit: Fit, residuals: ResidualModel) -> tuple[Fit, float]:
    """Fit after a step towards the datasheet, and what the step gained."""
    method, start = residuals.method.fitting, fit.hypothesis
    misfit = max(fit.chi2.sum() / fit.samples.sum(), 1.0)
    tangent = _with_uncertainty(central_jacobian(start, residuals), misfit)
    goal = damped_step(start, tangent, method, TINY, inner_weight=UNIFORM_PRECISION)
    tried = [start, *(_between(start, goal, share) for share in _STEP_SHARES)]
    logs = range(len(start.problem.logs))
    chi2 = np.moveaxis(np.array([chi2_by_joint(tried, residuals, j) for j in logs]), -1, 0)
    violations = [each.prior_violations(method.prior_softness) for each in tried]
    costs = [_map_cost(*each, misfit) for each in zip(tried, chi2, violations)]
    best = int(np.argmin(costs))
    spread = standard_deviations(start.free_parameters, tangent.normal[0], 1.0)
    refined = dataclasses.replace(fit, hypothesis=tried[best], chi2=chi2[best],
                                  prior_violation=violations[best], spread=spread)
    return refined, costs[0] - costs[best]


def _with_uncertainty(tangent: Tangent, misfit: float) -> Tangent:
    """Tangent whose logs count as little as the model fits them badly."""
    is_of_logs = np.arange(len(tangent.residual)) < len(tangent.slopes)
    weight = np.where(is_of_logs, 1 / np.sqrt(misfit), 1.0)
    return Tangent(tangent.parts, weight * tangent.residual, weight[:, None] * tangent.columns)


def _between(start: Hypothesis, goal: Hypothesis, share: float) -> Hypothesis:
    """Hypothesis part of the way to another one."""
    return start.with_values(start.moved(
        [(parameter, (1.0 - share) * start.get(parameter) + share * goal.get(parameter))
         for parameter in start.free_parameters]))


def _map_cost(hypothesis: Hypothesis, chi2: np.ndarray, violation: np.ndarray, misfit: float,
              ) -> float:
    """Negative log posterior, twice: what logs and datasheet have against a model."""
    distance = np.abs([(hypothesis.get(parameter) - parameter.centre) / parameter.tolerance
                       for parameter in hypothesis.free_parameters
                       if parameter.tolerance and parameter.centre is not None])
    inner = np.where(distance < 1.0, distance**2, 2.0 * distance - 1.0).sum()
    return (chi2[:len(hypothesis.problem.fit)].sum() / misfit + violation @ violation
            + UNIFORM_PRECISION * inner)


_PRUNED: FitCache[Fit, Fit] = FitCache()


def prune_joints(fit: Fit, residuals: ResidualModel, excess_of_nominal: float) -> Fit:
    """Return a fit whose causes are left out at joints where they do no more than noise."""
    known = _PRUNED.of(residuals)
    if fit not in known:
        pruned = _without_idle_joints(fit, residuals, excess_of_nominal)
        known[fit] = known[pruned] = pruned
    return known[fit]


def _without_idle_joints(fit: Fit, residuals: ResidualModel, excess_of_nominal: float) -> Fit:
    method = residuals.method.fitting
    rise = method.idle_joint_excess + method.idle_joint_share * excess_of_nominal
    for place, member in enumerate(fit.hypothesis.members):
        if member.cause.shared or len(member.joints) == 1:
            continue
        slopes_valid = fit.excess < (method.idle_joint_excess
                                     + method.slopes_valid_share * excess_of_nominal)
        predicted = {k: _predicted_rise(fit, place, k) for k in member.joints}
        idle = [k for k in predicted if predicted[k] < rise]
        if slopes_valid and 1 < len(idle) < len(predicted):
            fit = _fit_without(fit, place, idle, residuals, rise * len(idle))
        for k in fit.hypothesis.members[place].joints:
            if not slopes_valid or predicted[k] < method.needed_joint_factor * rise:
                fit = _fit_without(fit, place, [k], residuals, rise)
    return fit


def _fit_without(fitted: Fit, place: int, joints: Sequence[int], residuals: ResidualModel,
                 rise: float) -> Fit:
    """Fit with a cause left out at some joints, if the excess rises by less; else the same."""
    method = residuals.method.fitting
    start = _left_out(fitted.hypothesis, place, joints)
    if start is None or (predicted_refit_rise(start, fitted, residuals)
                         > method.refit_rise_factor * rise):
        return fitted
    refitted = fit(start, residuals, method.pruning_iterations)
    return refitted if refitted.excess - fitted.excess < rise else fitted


def predicted_refit_rise(start: Hypothesis, fit: Fit, residuals: ResidualModel) -> float:
    """Rise of the excess on the fit logs that the slopes of a start predict for its fit."""
    tangent, samples = jacobian(start, residuals), fit.samples[:len(start.problem.fit)]
    cost = tangent.cost - predicted_gain(start, tangent, residuals.method.fitting)
    return (cost - fit.cost) / (samples.sum() / start.problem.n)


def _predicted_rise(fit: Fit, place: int, k: int) -> float:
    """Rise of the excess that the slopes of a fit predict where a joint loses a cause."""
    hypothesis = fit.hypothesis
    member, parameters = hypothesis.members[place], hypothesis.free_parameters
    neutral = {f"{member.name}.{number.name}": number.neutral for number in member.cause.numbers
               if number.neutral is not None}
    own = [i for i, parameter in enumerate(parameters)
           if parameter.key in neutral and parameter.joint == k]
    distance = np.array([hypothesis.get(parameters[i]) - neutral[parameters[i].key] for i in own])
    information = np.linalg.pinv(fit.covariance[np.ix_(own, own)], hermitian=True)
    return distance @ information @ distance / (fit.samples.sum() / hypothesis.problem.n)


def _left_out(hypothesis: Hypothesis, place: int, left_out: Collection[int]) -> Hypothesis | None:
    """Hypothesis with a cause that is neutral at some joints; None where it acts at no other."""
    member = hypothesis.members[place]
    joints = tuple(k for k in member.joints if k not in left_out)
    if not joints:
        return None
    values = dict(hypothesis.values)
    for number in member.cause.numbers:
        key = f"{member.name}.{number.name}"
        if number.neutral is not None:
            values[key] = values[key].copy()
            values[key][..., list(left_out)] = number.neutral
    members = list(hypothesis.members)
    members[place] = dataclasses.replace(member, joints=joints)
    return dataclasses.replace(hypothesis, members=tuple(members), values=values)
