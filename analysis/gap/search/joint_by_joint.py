"""Several causes at once: each joint with the cause that leaves least of it.

Joints move mostly by their own drives, so that causes at different joints are nearly orthogonal.
A hypothesis with another cause at each joint tries one for all of them at the price of a single
fit, and what some such hypotheses leave at each joint says which cause belongs where.  A search
that adds one cause after the other takes as many rounds as there are causes, and begins with one
that stands for several.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import (
    Candidate,
    compatible,
    fitted_members,
    joints_worth_keeping,
    spent_parameters,
)
from clie_blocks.analysis.gap.search.event_times import refit_event_times
from clie_blocks.analysis.gap.search.racing import first_steps
from clie_blocks.analysis.gap.search.wave_orders import refit_orders

_OF_JOINT = ("inertia", "damping", "load")


def fit_joint_by_joint(base: Fit, of_joints: Sequence[Sequence[Candidate]], nominal: Fit,
                       residuals: ResidualModel) -> list[Fit]:
    """Fit a hypothesis with the best further cause of each joint.

    Parameters
    ----------
    base : Fit
        To which causes are added; with or without own ones.
    of_joints : sequence of sequence of Candidate
        Causes that may explain what the base leaves of each joint, best first.
    nominal : Fit
        The refitted nominal model.
    residuals : ResidualModel
        Of the logs.

    Returns
    -------
    list of Fit
        The fits that were made, that hypothesis last; none where a single joint asks for a cause.

    """
    method = residuals.method.search
    worth = joints_worth_keeping(
        np.array([of[0].score if of else 0.0 for of in of_joints]), residuals.method)
    if len(worth) < 2 or not all(of_joints[k] for k in worth):
        return []
    tried: list[tuple[Fit, dict[int, Member]]] = []
    for members in _hypotheses({k: of_joints[k] for k in worth}, base, residuals):
        if residuals.is_out_of_time:
            break
        start = initial_guess(Candidate((*fitted_members(base.hypothesis), *_merged(members)),
                                        0.0, base), residuals, nominal)
        begun = first_steps(start, nominal, residuals)
        tried.append((begun, _fitted(begun, members)))
    best = _best_of_joints(base, tried, residuals)
    if len({member.cause.key for _, member in best.values()}) < 2:
        return [each for each, _ in tried]
    found = fit(_assembled(base, best), residuals, method.finalist_steps,
                lender(nominal, residuals.method.fitting))
    return [*(each for each, _ in tried),
            refit_orders(refit_event_times(found, residuals), residuals)]


def _hypotheses(of_joints: dict[int, Sequence[Candidate]], base: Fit, residuals: ResidualModel,
                ) -> Iterator[dict[int, Member]]:
    """The first cause of each joint, then the second, and so on, where they go together."""
    method = residuals.method.search
    left = {k: [candidate.members[0] for candidate in candidates[:method.joint_candidates]]
            for k, candidates in of_joints.items()}
    most = method.most_causes - len(base.hypothesis.members)
    while any(left.values()):
        chosen: dict[int, Member] = {}
        for k in sorted(left, key=lambda joint: -of_joints[joint][0].score):
            for member in left[k]:
                if _fits_in(member, chosen, base, most):
                    chosen[k] = member
                    left[k].remove(member)
                    break
        if not chosen:
            return
        yield chosen


def _fits_in(member: Member, chosen: dict[int, Member], base: Fit, most: int) -> bool:
    """Whether a cause can stand beside those of a base and of other joints."""
    others = {other.cause.key: other for other in chosen.values()}
    if any(member.cause.key == other.cause.key for other in base.hypothesis.members):
        return False
    return member.cause.key in others or (len(others) < most and all(
        compatible(member, other) for other in (*base.hypothesis.members, *others.values())))


def _merged(members: dict[int, Member]) -> list[Member]:
    """Each cause once, at all joints for which it was chosen."""
    by_cause: dict[str, Member] = {}
    for k, member in members.items():
        known = by_cause.get(member.cause.key, member)
        values = {name: value.copy() for name, value in known.values.items()}
        for name, value in values.items():
            value[..., k] = member.values[name][..., k]
        by_cause[member.cause.key] = Member(member.cause, tuple(sorted({*known.joints, k})),
                                            values, member.sizes)
    return list(by_cause.values())


def _fitted(begun: Fit, members: dict[int, Member]) -> dict[int, Member]:
    """The causes of the joints with what was fitted, where that is no bound.

    There a fit has left the right values, as it made up for wrong causes of other joints.
    """
    by_key = {member.cause.key: member for member in fitted_members(begun.hypothesis)}
    return {k: member if _is_at_bound(by_key[member.cause.key], k) else Member(
        member.cause, (k,), by_key[member.cause.key].values, member.sizes)
        for k, member in members.items()}


def _is_at_bound(member: Member, k: int) -> bool:
    """Whether a shape of a cause, such as a time, ended at a bound at joint k."""
    return any(np.any(np.isin(member.values[number.name][..., k], (number.lower, number.upper)))
               for number in member.cause.numbers if number.is_scale and not number.fixed)


def _best_of_joints(base: Fit, tried: Sequence[tuple[Fit, dict[int, Member]]],
                    residuals: ResidualModel) -> dict[int, tuple[Fit, Member]]:
    """Fit and cause of each joint with the best odds by what the joint is left with.

    The joint that gains most comes first, and causes that cannot stand beside its own give way.
    """
    calibration, method = residuals.method.calibration, residuals.method.search
    logs = len(base.hypothesis.problem.fit)
    before, samples = base.chi2[:logs].sum(axis=0), base.samples[:logs].sum(axis=0)
    odds: dict[int, list[tuple[float, Fit, Member]]] = {}
    for each, members in tried:
        after = each.chi2[:logs].sum(axis=0)
        for k, member in members.items():
            if before[k] - after[k] > method.joint_gain:
                score = calibration.score(after[k] / samples[k] - 1.0, before[k] / samples[k])
                paid = calibration.parameter_cost * spent_parameters(
                    member, base.hypothesis.problem.fit_runs)
                odds.setdefault(k, []).append((score - paid, each, member))
    best: dict[int, tuple[Fit, Member]] = {}
    most = method.most_causes - len(base.hypothesis.members)
    for k in sorted(odds, key=lambda joint: -before[joint]):
        for _, each, member in sorted(odds[k], key=lambda one: -one[0]):
            if _fits_in(member, {joint: other for joint, (_, other) in best.items()}, base, most):
                best[k] = each, member
                break
    return best


def _assembled(base: Fit, best: dict[int, tuple[Fit, Member]]) -> Hypothesis:
    """Hypothesis of all joints, each with cause and joint model as they were fitted together."""
    strongest = next(iter(best.values()))[0].hypothesis
    start = build_hypothesis(
        base.hypothesis.problem,
        (*fitted_members(base.hypothesis), *_merged({k: one for k, (_, one) in best.items()})),
        strongest)
    values = {name: start.values[name].copy() for name in _OF_JOINT}
    for k, (source, _) in best.items():
        for name, value in values.items():
            value[k] = source.hypothesis.values[name][k]
    return start.with_values({**start.values, **values})
