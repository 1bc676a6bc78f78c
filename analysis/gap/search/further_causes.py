"""Candidates with further causes: one or two more than a fit, one in exchange, pairs at first."""

from collections.abc import Sequence

from clie_blocks.analysis.gap.causes.transmission import JOINT_ELASTICITY
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.problem.problem import holds_stably
from clie_blocks.analysis.gap.search.alternatives import holds_its_coupling
from clie_blocks.analysis.gap.search.candidates import Candidate, extensions, fitted_members
from clie_blocks.analysis.gap.search.contest import Contest, distinct
from clie_blocks.analysis.gap.search.racing import (
    pairs_worth_fitting,
    predicted_excess,
    training_excess,
    worth_extending,
)
from clie_blocks.analysis.gap.search.screening import Screen


def one_more_cause(contest: Contest, screen: Screen, base: Fit) -> list[Candidate]:
    """Candidates that add to a fit one of the causes that explain most of what it leaves.

    And a soft gear, of which the screening predicts far too little; and what changes the links,
    where it, joint by joint, does so too, beside a set that explains most of the excess.  A fit
    whose loop is not stable says nothing of what a torque would do.
    """
    method, values = contest.method.search, base.hypothesis.values
    problem = contest.residuals.problem
    if not holds_stably(problem.law, values["inertia"], values["damping"]):
        return []
    left = contest.steps.screen_residual(screen, contest.residuals, base)
    leading = contest.steps.singles(left, contest.residuals, base, contest.causes)
    chosen = list(extensions(base, leading[:method.screened_extensions]))[:method.extensions]
    chosen += extensions(base, [one for one in leading
                                if one.members[-1].cause is JOINT_ELASTICITY])
    if base.excess < method.hopeless_share * contest.nominal.excess:
        chosen += extensions(base, [one for one in leading if one.members[-1].cause.changes_links])
    return distinct(chosen)


def two_more_causes(contest: Contest, screen: Screen, base: Fit) -> list[Candidate]:
    """Candidates that add to a fit a pair of causes that explains most of what it leaves."""
    method, known = contest.method.search, len(base.hypothesis.members)
    if known + 2 > method.most_causes or contest.residuals.is_out_of_time:
        return []
    left = contest.steps.screen_residual(screen, contest.residuals, base)
    return [one for one in extensions(base, contest.steps.pairs(left, contest.method))
            if len(one.members) > known
            and predicted_excess(one) < method.hopeless_share * training_excess(base)][
                :method.leading_pairs]


def one_exchanged(contest: Contest, screen: Screen, base: Fit) -> list[Candidate]:
    """Candidates with one cause of a set exchanged for one that explains what it explained."""
    members, candidates = fitted_members(base.hypothesis), []
    like = lender(contest.nominal, contest.method.fitting)
    for k, member in enumerate(members):
        others = (*members[:k], *members[k + 1:])
        if contest.residuals.is_out_of_time:
            break
        if not others or not holds_its_coupling(others):
            continue
        without = fit(build_hypothesis(contest.residuals.problem, others, base.hypothesis),
                      contest.residuals, 0, like)
        candidates += [one for one in one_more_cause(contest, screen, without)
                       if one.members[-1].cause.key != member.cause.key]
    return candidates


def first_pairs(contest: Contest, screen: Screen, alone: list[Candidate], fits: list[Fit],
                extended: Sequence[Fit]) -> list[Candidate]:
    """Pairs that are worth a fit: from the screening, and as extensions of the best fits."""
    screened = contest.steps.pairs(screen, contest.method)[:contest.method.search.leading_pairs]
    chosen = pairs_worth_fitting(screened, alone, fits, contest.nominal, contest.method)
    for one in extended:
        chosen += [candidate for candidate in one_more_cause(contest, screen, one)
                   if worth_extending(candidate, contest.nominal, contest.method)]
    return distinct(chosen)
