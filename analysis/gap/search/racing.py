"""The race of candidates: all that compete take a few steps, the best are fitted to the end."""

from collections.abc import Iterable, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.compile_ahead import compile_ahead
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess, with_joint_model
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import (
    first_lender,
    fit,
    is_long,
    lender,
)
from clie_blocks.analysis.gap.fitting.parameter_count import parameter_count
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import Candidate, cause_keys
from clie_blocks.analysis.gap.search.event_times import refit_event_times
from clie_blocks.analysis.gap.search.wave_orders import refit_orders


def race(residuals: ResidualModel, nominal: Fit, candidates: Sequence[Candidate], finalists: int,
         ) -> list[Fit]:
    """Fit candidates for a few steps, then the best of them, and the favourites, to the end.

    Returns all of them; only those that competed are there.  Where none of them explains most of
    the gap of an arm of many joints, fewer are continued, with slopes of the refitted nominal
    model: they only compete for a place in larger sets.
    """
    method = residuals.method
    begun = _first_fits(residuals, nominal, candidates)
    order = sorted(begun, key=lambda one: one.total)
    like = lender(nominal, method.fitting)
    if order and is_long(residuals) and leaves_much(order[0], nominal, method):
        finalists = min(finalists, method.search.pair_finalists)
        like = first_lender(nominal, residuals)
    to_finish = _finalists(begun, order, candidates, finalists, nominal, method)
    finished: list[Fit] = []
    for one in sorted(to_finish, key=lambda one: one.total):
        start = one.hypothesis
        if finished and finished[0].cost < one.cost:
            start = with_joint_model(finished[0], start, one.cost, residuals)
        finished.append(fit(start, residuals, method.search.finalist_steps, like))
        finished.sort(key=lambda one: one.total)
    if finished and _is_still_moving(finished[0], method.search.finalist_steps, method):
        finished[0] = _to_the_end(finished[0], residuals)
    of_causes = {cause_keys(candidate.members): candidate for candidate in candidates}
    return [refit_orders(refit_event_times(one, residuals), residuals)
            if _seeks_anew(one, of_causes[cause_keys(one.hypothesis.members)],
                           one is finished[0],
                           nominal, method) and not residuals.is_out_of_time else one
            for one in finished] + [one for one in order if one not in to_finish]


def _seeks_anew(fit: Fit, candidate: Candidate, is_best: bool, nominal: Fit, method: Method,
                ) -> bool:
    """Whether onsets, phases and orders of a fit are worth seeking anew.

    Those of causes that the fit which it started from has were sought there; only the best one
    seeks them once more.
    """
    known = candidate.extends.hypothesis.members if candidate.extends else ()
    is_new = any(number.fixed for member in fit.hypothesis.members
                 if member.cause not in [one.cause for one in known]
                 for number in member.cause.numbers)
    without = nominal if alternative_to(candidate) is not None else candidate.extends or nominal
    return (is_best or is_new) and explains_fair_share(fit, without, method)


def _finalists(begun: Sequence[Fit], order: Sequence[Fit], candidates: Sequence[Candidate],
               count: int, nominal: Fit, method: Method) -> list[Fit]:
    """Fits to continue: the best, and favourites of the screening where all are slow."""
    leaders = [leader for leader in map(alternative_to, candidates) if leader is not None]
    best = least_excess([*order[:1], *leaders])
    limit = pruning_limit(best, nominal.excess if leaders else 0.0, method)
    chosen = [one for one in order[:count] if one.excess < limit]
    if not leaders and best > method.search.unresolved_share * nominal.excess:
        chosen += [one for one in begun[:method.search.favourites] if one not in chosen]
    return chosen


def odds_against(fit: Fit, nominal: Fit, method: Method) -> float:
    """Odds against a fit by what it leaves and, of several causes, by what these cost [nats].

    Causes alone compete by what they leave: which of them has more numbers says little there.
    """
    calibration, more = method.calibration, len(fit.hypothesis.members) - 1
    spent = max(parameter_count(fit) - 1.0, more) if more else 0.0
    return float(more * calibration.cause_cost + calibration.parameter_cost * spent
                 - calibration.score(fit.excess, nominal.excess))


def least_excess(fits: Iterable[Fit]) -> float:
    """Excess of the best of some fits; 0 for none."""
    return min((fit.excess for fit in fits), default=0.0)


def explains_fair_share(fit: Fit, base: Fit, method: Method) -> bool:
    """Whether a fit explains enough of what a base leaves to seek its onsets and phases anew.

    The base is a fit without its last cause, or the nominal model.  Onsets that the screening
    missed cost a right fault less than what a wrong one leaves.
    """
    return training_excess(fit) < method.search.fair_share * training_excess(base)


def alternative_to(candidate: Candidate) -> Fit | None:
    """The fit to which a candidate is an alternative, or of which it is a part."""
    return candidate.extends if candidate.score == 0.0 else None


def part_of(candidate: Candidate) -> Fit | None:
    """The fit of which a candidate has some causes, and no other."""
    leader = alternative_to(candidate)
    if leader is None:
        return None
    of_leader = {member.cause for member in leader.hypothesis.members}
    return leader if {member.cause for member in candidate.members} < of_leader else None


def pruning_limit(best: float, excess_of_nominal: float, method: Method) -> float:
    """Excess beyond which nothing is fitted further: far behind the best, and much of all.

    What a part of a fit leaves says what the rest of it removes, so little is known exactly.
    """
    return max(method.search.far_behind * max(best, method.calibration.healthy),
               method.search.unresolved_share * excess_of_nominal)


def _first_fits(residuals: ResidualModel, nominal: Fit, candidates: Sequence[Candidate],
                ) -> list[Fit]:
    """First steps of the candidates that compete, those with the best predictions first."""
    begun: list[Fit] = []
    best, gain = None, 0.0
    in_order = sorted(candidates, key=predicted_excess)
    compile_ahead(build_hypothesis(residuals.problem, candidate.members, nominal.hypothesis)
                  for candidate in in_order[1:])
    for candidate in in_order:
        if begun and residuals.is_out_of_time:
            break
        if best is None or (can_compete(candidate, best, residuals.method) and not is_outclassed(
                candidate, best, gain, nominal, residuals.method)):
            start = initial_guess(candidate, residuals, nominal, best)
            begun.append(_first_steps(start, candidate, residuals, nominal))
            if best is None or training_excess(begun[-1]) < training_excess(best):
                best, gain = begun[-1], candidate.score
    return begun


def _first_steps(start: Hypothesis, candidate: Candidate, residuals: ResidualModel, nominal: Fit,
                 ) -> Fit:
    """Fit after a few steps; as it starts, where a part of the leader starts far behind it.

    A part starts with the leader's parameters; where other alternatives start says nothing.
    """
    leader, before = part_of(candidate), candidate.extends or nominal
    if leader is not None:
        unfitted = fit(start, residuals, 0, first_lender(before, residuals))
        method = residuals.method
        if (starts_far_behind(unfitted, leader, nominal, method)
                and is_needed(leader, start.members, nominal, method)):
            return unfitted
    return first_steps(start, before, residuals)


def first_steps(start: Hypothesis, before: Fit, residuals: ResidualModel) -> Fit:
    """Fit after the first steps from a start with the joint model of another fit."""
    return fit(start, residuals, residuals.method.search.first_steps,
               first_lender(before, residuals), borrows_only=is_long(residuals))


def starts_far_behind(start: Fit, leader: Fit, nominal: Fit, method: Method) -> bool:
    """Whether the part of a leader leaves so much that the rest of the leader is needed."""
    limit = pruning_limit(training_excess(leader), training_excess(nominal), method)
    return training_excess(start) > limit


def is_needed(leader: Fit, part: Sequence[Member], nominal: Fit, method: Method) -> bool:
    """Whether a leader is predicted to be far worse without some causes than with them."""
    limit = pruning_limit(training_excess(leader), training_excess(nominal), method)
    return training_excess(leader, -predicted_loss(leader, part)) > limit


def predicted_loss(leader: Fit, part: Sequence[Member]) -> float:
    """Rise of chi^2 if a leader keeps a part of its causes; infinite where that cannot be told.

    That is linear: the other parameters follow as the Jacobian of the leader says.
    """
    kept = {member.cause for member in part}
    neutral = {f"{member.name}.{number.name}": number.neutral
               for member in leader.hypothesis.members if member.cause not in kept
               for number in member.cause.numbers if number.neutral is not None}
    lost = [(i, leader.hypothesis.get(parameter) - neutral[parameter.key])
            for i, parameter in enumerate(leader.hypothesis.free_parameters)
            if parameter.key in neutral]
    if not lost:
        return np.inf
    indices, change = [i for i, _ in lost], np.array([value for _, value in lost])
    covariance = leader.covariance[np.ix_(indices, indices)]
    deviations = np.sqrt(np.diag(covariance)).clip(min=1e-150)
    correlation = covariance / np.outer(deviations, deviations)
    change = change / deviations
    return float(change @ np.linalg.pinv(correlation, hermitian=True) @ change)


def can_compete(candidate: Candidate, best: Fit, method: Method) -> bool:
    """Whether a candidate may come near the best fit: as predicted, or with a cause of that one.

    Predictions are linear: what they leave of a large excess is blurred.
    """
    added = candidate.members[-1].cause
    shared = added in [member.cause for member in best.hypothesis.members]
    if shared or added.changes_links or candidate.extends is None:
        return True
    blur = method.search.unresolved_share * training_excess(candidate.extends)
    near = method.search.far_behind * max(training_excess(best), method.calibration.healthy)
    return predicted_excess(candidate) < near + blur


def is_outclassed(candidate: Candidate, best: Fit, gain: float, nominal: Fit, method: Method,
                  ) -> bool:
    """Whether a cause alone is explained away: one leaves only noise of a large gap.

    It was predicted to explain far less than that one, whose predicted gain is `gain`.  Of a cause
    that all joints share the screening, joint by joint, predicts too little.
    """
    healthy, whole = method.calibration.healthy, training_excess(nominal)
    return (candidate.extends is None and not candidate.members[-1].cause.shared
            and training_excess(best) < healthy < method.search.fair_share * whole
            and candidate.score < method.search.competing_score * gain)


def predicted_excess(candidate: Candidate) -> float:
    """Excess that a candidate is predicted to leave, where it extends a fit.

    What a further cause is predicted to explain of what a fit leaves is nearly what it does.  Of
    what the nominal model leaves, which has absorbed some of a large effect, it is too little,
    and for alternatives there is no prediction: both are always worth trying.
    """
    if candidate.extends is None or alternative_to(candidate) is not None:
        return -np.inf
    return training_excess(candidate.extends, candidate.score)


def worth_extending(candidate: Candidate, nominal: Fit, method: Method) -> bool:
    """Whether a further cause is predicted to explain a fair share of what a fit leaves.

    A cause that is there explains half of it and more; many that are not there explain a little.
    Together the causes must explain most of what there is: something unknown leaves less.
    Of a link that moves apart from its motor, and of what changes the links of all joints, the
    screening knows too little to predict.
    """
    left = training_excess(candidate.extends or nominal)
    added = candidate.members[-1].cause
    if left <= method.calibration.healthy:
        return False
    if added.moves_apart or added.changes_links:
        return True
    return predicted_excess(candidate) < min(
        method.search.fair_share * left,
        method.search.several_causes_share * training_excess(nominal))


def pairs_worth_fitting(pairs: Sequence[Candidate], alone: Sequence[Candidate],
                        fits: Sequence[Fit], nominal: Fit, method: Method) -> list[Candidate]:
    """Return the pairs that are predicted to leave less than the best single cause does.

    `fits` are those of the single causes, `alone`.  Where the best of them leaves far less than
    any was predicted to, the nominal model has absorbed too much for predictions.  Then all pairs
    are returned but those with its cause: what another one adds to it, its own extensions show.
    """
    best = min(fits, key=training_excess)
    reached = training_excess(best)
    predicted = min(training_excess(nominal, candidate.score) for candidate in alone)
    if reached < method.search.absorbed_ratio * predicted:
        leading = {member.cause for member in best.hypothesis.members}
        return [pair for pair in pairs
                if leading.isdisjoint(member.cause for member in pair.members)]
    limit = min(reached, method.search.several_causes_share * training_excess(nominal))
    return [pair for pair in pairs if training_excess(nominal, pair.score) < limit]


def training_excess(fit: Fit, gain: float = 0.0) -> float:
    """Excess of a fit on the logs that it was fitted to, after a gain."""
    samples = fit.samples[:len(fit.hypothesis.problem.fit)]
    return (fit.cost - gain) / samples.sum(axis=0).mean() - samples.shape[1]


def leaves_much(fit: Fit, nominal: Fit, method: Method) -> bool:
    """Whether a fit explains less than most of the gap."""
    return fit.excess > method.search.hopeless_share * nominal.excess


def _to_the_end(moving: Fit, residuals: ResidualModel) -> Fit:
    """Fit of a leader that ends by itself, or for want of rounds: an order may take many steps."""
    steps = residuals.method.search.leader_steps
    for _ in range(residuals.method.search.leader_rounds):
        moving = fit(moving.hypothesis, residuals, steps)
        if not _is_still_moving(moving, steps, residuals.method):
            break
    return moving


def _is_still_moving(fit: Fit, steps: int, method: Method) -> bool:
    """Whether a fit ended for want of steps, away from the noise."""
    return fit.iterations == steps and fit.excess > method.calibration.healthy
