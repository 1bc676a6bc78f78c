"""The search for causes: one alone, then two, then one more at a time while much is left."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.load import COUPLING
from clie_blocks.analysis.gap.causes.transmission import JOINT_ELASTICITY
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.fitting.refinement import prune_joints
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem, holds_stably
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.acting_order import in_best_order
from clie_blocks.analysis.gap.search.alternatives import (
    FEW,
    alternatives,
    holds_its_coupling,
)
from clie_blocks.analysis.gap.search.candidates import (
    Candidate,
    cause_keys,
    extensions,
    fitted_members,
    of_each_joint,
    pairs,
    singles,
)
from clie_blocks.analysis.gap.search.file_numbers import (
    fit_numbers,
    number_beside,
    with_coupled_number,
    with_swapped_number,
    wrong_numbers,
)
from clie_blocks.analysis.gap.search.joint_by_joint import fit_joint_by_joint
from clie_blocks.analysis.gap.search.racing import (
    least_excess,
    odds_against,
    pairs_worth_fitting,
    predicted_excess,
    pruning_limit,
    race,
    training_excess,
    worth_extending,
)
from clie_blocks.analysis.gap.search.screening import Screen, screen_causes, screen_residual


@dataclasses.dataclass(frozen=True)
class SearchSteps:
    """The functions that a search is made of: each can be timed, or swapped for another."""

    screen: Callable[[ResidualModel, Fit, Sequence[Cause]], Screen] = screen_causes
    screen_residual: Callable[[Screen, ResidualModel, Fit], Screen] = screen_residual
    singles: Callable[[Screen, ResidualModel, Fit, Sequence[Cause]], list[Candidate]] = singles
    pairs: Callable[[Screen, Method], list[Candidate]] = pairs
    race: Callable[[ResidualModel, Fit, Sequence[Candidate], int], list[Fit]] = race
    wrong_numbers: Callable[[Problem], list[Member]] = wrong_numbers
    fit_numbers: Callable[[Sequence[Member], ResidualModel, Fit], Fit] = fit_numbers
    prune: Callable[[Fit, ResidualModel, float], Fit] = prune_joints


SEARCH_STEPS = SearchSteps()


class SearchResult(NamedTuple):
    """All hypotheses that were fitted, and whether the time sufficed for all that had to be."""

    fits: list[Fit]
    is_complete: bool


def search_causes(residuals: ResidualModel, nominal: Fit, causes: Sequence[Cause] = CAUSES,
                  steps: SearchSteps = SEARCH_STEPS) -> SearchResult:
    """Fit the leading single causes, then pairs, then sets of more while much is left.

    Numbers of the robot file beside them, and then the neighbours of the leading set: without
    these, which may find a better one, the search is complete as well.
    """
    search = _Search(residuals, nominal, causes, steps)
    screen = steps.screen(residuals, nominal, causes)
    fits = search.with_wrong_numbers(screen, search.fits_of_causes(screen))
    is_complete = not residuals.is_out_of_time
    improved = search.with_neighbours(screen, fits)
    if improved and search.leader(improved) not in fits:
        improved = search.with_wrong_numbers(screen, improved)
    return SearchResult(improved, is_complete)


@dataclasses.dataclass(frozen=True)
class _Search:
    """A search for causes around a refitted nominal model."""

    residuals: ResidualModel
    nominal: Fit
    causes: Sequence[Cause]
    steps: SearchSteps
    leaders: list[Fit] = dataclasses.field(default_factory=list)  # whose alternatives were tried
    settled: list[Fit] = dataclasses.field(default_factory=list)  # whose neighbours were tried
    ordered: list[Fit] = dataclasses.field(default_factory=list)  # whose causes act in good order

    @property
    def method(self) -> Method:
        """Thresholds."""
        return self.residuals.method

    def with_wrong_numbers(self, screen: Screen, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of numbers of the robot file, alone and with one cause more."""
        method, members = self.method.search, self.steps.wrong_numbers(self.residuals.problem)
        if not members or self.residuals.is_out_of_time:
            return fits
        of_causes = self.near_the_best(sorted(fits, key=self.odds_against)[:method.described_fits])
        alone = sorted(self.fits_of_numbers([(member,) for member in members]), key=_total)
        swapped = [some for fit in of_causes
                   for some in with_swapped_number(fitted_members(fit.hypothesis), members)]
        if COUPLING in self.causes:
            swapped += [some for fit in of_causes for some in with_coupled_number(
                fitted_members(fit.hypothesis), self.residuals.problem)]
        found = self.with_raced(fits + alone + self.fits_of_numbers(swapped), [],
                                method.pair_finalists)
        if self.is_done(found):
            return found
        more = [candidate for fit in self.near_the_best(alone[:1], found)
                for candidate in self.one_more_cause(screen, fit)]
        more += [number_beside(fit, member, self.residuals) for fit in of_causes
                 for member in members if not self.residuals.is_out_of_time]
        worth = [candidate for candidate in _distinct(more)
                 if worth_extending(candidate, self.nominal, self.method)]
        return self.with_raced(found, worth, method.pair_finalists)

    def fits_of_numbers(self, hypotheses: Sequence[tuple[Member, ...]]) -> list[Fit]:
        """Fits of hypotheses with a number of the robot file, each set of causes once.

        Those for which there is no time are not there.
        """
        distinct = {cause_keys(members): members
                    for members in hypotheses}
        return [self.steps.fit_numbers(members, self.residuals, self.nominal)
                for members in distinct.values() if not self.residuals.is_out_of_time]

    def fits_of_causes(self, screen: Screen) -> list[Fit]:
        """Single causes, pairs, and larger sets."""
        method = self.method.search
        alone = self.steps.singles(screen, self.residuals, self.nominal, self.causes)
        alone = alone[:method.leaders]
        if not alone:  # all of the causes need links that are not stated
            return []
        fits = self.with_raced([], alone, method.single_finalists)
        if self.is_done(fits) or len(self.causes) == 1:
            return fits
        best = _least(fits)
        fits = self.with_joint_by_joint(screen, self.nominal, fits)
        if self.has_paid(best, _least(fits)):
            return self.with_larger_sets(screen, fits, [])
        extended = self.near_the_best(sorted(fits, key=self.odds_against)[:method.extended_fits])
        fits = self.with_raced(fits, self.pairs(screen, alone, fits, extended),
                               method.pair_finalists)
        if not self.is_done(fits) and not self.has_paid(best, _least(fits)):
            fits = self.with_two_more(screen, extended, fits)
        return self.with_larger_sets(screen, fits, extended)

    def with_two_more(self, screen: Screen, bases: Sequence[Fit], fits: list[Fit]) -> list[Fit]:
        """Fits, and those of some of them with two causes more, where one more has not paid.

        Causes that make up for one another, such as friction and drag beside a damping that was
        refitted, show together alone.
        """
        more = [candidate for base in bases for candidate in self.two_more_causes(screen, base)]
        return self.with_fitted(fits, _new(fits, sorted(more, key=lambda one: -one.score)),
                                self.method.search.pair_finalists)

    def with_larger_sets(self, screen: Screen, fits: list[Fit], extended: Sequence[Fit],
                         ) -> list[Fit]:
        """Fits, and those of larger sets around the likeliest one, and around that of least cost.

        Where much is left the odds of few causes may lead, though each more would pay.
        """
        extended = list(extended)
        for best_of in (self.leader, _least):
            fits = self.with_growing_set(screen, fits, extended, best_of)
            fits = self.with_raced(fits, [], self.method.search.larger_finalists)
        return fits

    def with_growing_set(self, screen: Screen, fits: list[Fit], extended: list[Fit],
                         best_of: Callable[[Sequence[Fit]], Fit]) -> list[Fit]:
        """Fits, and those of the best one with more causes, as long as the last one has paid.

        Each step starts from the best fit of all, so that a cause that another has made
        superfluous is dropped with the smaller set, or swapped by the alternatives.
        """
        if len(best_of(fits).hypothesis.members) <= FEW:  # soon done, and they may leave nothing
            fits = self.with_raced(fits, [], self.method.search.larger_finalists)
        best, has_paid = best_of(fits), True
        while not (self.is_done(fits) or best in extended or not has_paid
                   or len(best.hypothesis.members) >= self.method.search.most_causes):
            extended.append(best)
            before = best
            for larger in self.grown(screen, before, fits):
                fits, best = larger, best_of(larger)
                has_paid = self.has_paid(before, best)
                if has_paid:
                    break
        return fits

    def grown(self, screen: Screen, base: Fit, fits: list[Fit]) -> Iterator[list[Fit]]:
        """Fits, and with each step more sets that are larger than a base, the likeliest first."""
        method, more = self.method.search, self.one_more_cause(screen, base)
        of_links = [one for one in more if one.members[-1].cause.changes_links]
        fits = self.with_fitted(fits, of_links, len(of_links))
        yield fits
        fits = self.with_joint_by_joint(screen, base, fits)
        yield fits
        more = [one for one in more if one not in of_links]
        predicted = min(map(predicted_excess, more), default=base.excess)
        if (base.excess <= method.hopeless_share * self.nominal.excess
                or predicted <= method.hopeless_share * base.excess):
            fits = self.with_fitted(fits, more, method.larger_finalists)
            yield fits
        yield self.with_two_more(screen, [base], fits)

    def with_joint_by_joint(self, screen: Screen, base: Fit, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of a base with the best further cause of each joint.

        Where the base, or one cause alone, leaves little, the joints hold no such causes.
        """
        little = self.method.search.joint_by_joint_share * self.nominal.excess
        if (self.residuals.problem.n == 1 or self.is_done(fits)
                or min(base.excess, least_excess(fits)) < little):
            return fits
        left = screen if base is self.nominal else self.steps.screen_residual(
            screen, self.residuals, base)
        found = fit_joint_by_joint(base, of_each_joint(left, self.residuals, base, self.causes),
                                   self.nominal, self.residuals)
        return self.with_pruned([*fits, *found])

    def with_neighbours(self, screen: Screen, fits: list[Fit]) -> list[Fit]:
        """Fits, and the neighbours of the leading set: one cause more, and one exchanged.

        A set that grew by one cause after the other may hold one that stood for several when it
        came, and the best set may not be the likeliest.
        """
        method = self.method.search
        for _ in range(method.neighbour_rounds):
            leader = None if self.is_done(fits) else self.leader(fits)
            hopeless = method.hopeless_share * self.nominal.excess
            if leader is None or leader in self.settled or leader.excess > hopeless:
                break
            self.settled.append(leader)
            if len(leader.hypothesis.members) < method.most_causes:
                fits = self.with_distinct(fits, self.one_more_cause(screen, leader))
            if self.leader(fits) is leader:
                fits = self.with_distinct(fits, self.exchanges(screen, leader))
        return fits

    def with_distinct(self, fits: list[Fit], candidates: Sequence[Candidate]) -> list[Fit]:
        """Fits, and those of candidates with sets of causes that none of them has."""
        return self.with_raced(fits, _new(fits, candidates), self.method.search.pair_finalists)

    def exchanges(self, screen: Screen, leader: Fit) -> list[Candidate]:
        """Candidates with one cause of a set exchanged for one that explains what it explained."""
        members, found = fitted_members(leader.hypothesis), []
        like = lender(self.nominal, self.method.fitting)
        for k, member in enumerate(members):
            others = (*members[:k], *members[k + 1:])
            if self.residuals.is_out_of_time:
                break
            if not others or not holds_its_coupling(others):
                continue
            without = fit(build_hypothesis(self.residuals.problem, others, leader.hypothesis),
                          self.residuals, 0, like)
            found += [one for one in self.one_more_cause(screen, without)
                      if one.members[-1].cause.key != member.cause.key]
        return found

    def leader(self, fits: Sequence[Fit]) -> Fit:
        """The fit around which others are worth trying.

        It leads by its odds: what is near a set that does not pay its causes can hardly lead,
        either.  But one that explains a fair share of what the best leaves may be near the right
        one, which is still in a false minimum.
        """
        likeliest, least = min(fits, key=self.odds_against), min(fits, key=_excess)
        is_fair = (likeliest.excess > self.method.calibration.healthy
                   and least.excess < self.method.search.fair_share * likeliest.excess)
        return least if is_fair else likeliest

    def odds_against(self, fit: Fit) -> float:
        """Odds against a fit, see `racing.odds_against`."""
        return odds_against(fit, self.nominal, self.method)

    def has_paid(self, smaller: Fit, larger: Fit) -> bool:
        """Whether a set of causes explains so much more than a smaller one as it costs."""
        calibration, whole = self.method.calibration, self.nominal.excess
        gain = (calibration.score(larger.excess, whole)
                - calibration.score(smaller.excess, whole))
        return bool(gain > calibration.cause_cost + calibration.parameter_cost)

    def pairs(self, screen: Screen, alone: list[Candidate], fits: list[Fit], extended: list[Fit],
              ) -> list[Candidate]:
        """Pairs that are worth a fit: from the screening, and as extensions of the best fits."""
        screened = self.steps.pairs(screen, self.method)[:self.method.search.leading_pairs]
        chosen = pairs_worth_fitting(screened, alone, fits, self.nominal, self.method)
        for one in extended:
            chosen += [candidate for candidate in self.one_more_cause(screen, one)
                       if worth_extending(candidate, self.nominal, self.method)]
        return _distinct(chosen)

    def one_more_cause(self, screen: Screen, fit: Fit) -> list[Candidate]:
        """Candidates that add to a fit one of the causes that explain most of what it leaves.

        And a soft gear, of which the screening predicts far too little; and what changes the
        links, where it, joint by joint, does so too, beside a set that explains most of the
        excess.  A fit whose loop is not stable says nothing of what a torque would do.
        """
        method, values = self.method.search, fit.hypothesis.values
        if not holds_stably(self.residuals.problem.law, values["inertia"], values["damping"]):
            return []
        left = self.steps.screen_residual(screen, self.residuals, fit)
        leading = self.steps.singles(left, self.residuals, fit, self.causes)
        chosen = list(extensions(fit, leading[:method.screened_extensions]))[:method.extensions]
        chosen += extensions(fit, [one for one in leading
                                   if one.members[-1].cause is JOINT_ELASTICITY])
        if fit.excess < method.hopeless_share * self.nominal.excess:
            chosen += extensions(fit, [one for one in leading
                                       if one.members[-1].cause.changes_links])
        return _distinct(chosen)

    def two_more_causes(self, screen: Screen, fit: Fit) -> list[Candidate]:
        """Candidates that add to a fit a pair of causes that explains most of what it leaves."""
        method, known = self.method.search, len(fit.hypothesis.members)
        if known + 2 > method.most_causes or self.residuals.is_out_of_time:
            return []
        left = self.steps.screen_residual(screen, self.residuals, fit)
        return [one for one in extensions(fit, self.steps.pairs(left, self.method))
                if len(one.members) > known
                and predicted_excess(one) < method.hopeless_share * training_excess(fit)][
                    :method.leading_pairs]

    def with_raced(self, fits: list[Fit], candidates: Sequence[Candidate], finalists: int,
                   ) -> list[Fit]:
        """Fits, and those of some candidates, with good leaders pruned and their alternatives."""
        fits = self.with_fitted(fits, candidates, finalists)
        tried: list[Candidate] = []
        for _ in range(self.method.search.alternative_rounds):
            fits = self.with_leader_in_order(fits)
            leader = self.leader(fits)
            if leader in self.leaders or self.residuals.is_out_of_time:
                break
            self.leaders.append(leader)
            alike = alternatives(leader, fits, self.causes, self.residuals, tried)
            fits = fits + self.steps.race(self.residuals, self.nominal, alike,
                                          self.method.search.alternative_finalists)
            tried += alike
        return fits

    def with_fitted(self, fits: list[Fit], candidates: Sequence[Candidate], finalists: int,
                    ) -> list[Fit]:
        """Fits, and those of some candidates, with good leaders pruned."""
        return self.with_pruned(
            fits + self.steps.race(self.residuals, self.nominal, candidates, finalists))

    def with_leader_in_order(self, fits: list[Fit]) -> list[Fit]:
        """Fits of which the leader's causes act in the order that explains most."""
        leader = self.leader(fits)
        if leader in self.ordered or leader.excess < self.method.calibration.healthy:
            return fits
        best = in_best_order(leader, self.nominal, self.residuals)
        self.ordered.append(best)
        return [fit for fit in fits if fit is not leader] + [best]

    def with_pruned(self, fits: list[Fit]) -> list[Fit]:
        """Fits of which good leaders have lost their idle joints."""
        good = [fit for fit in fits
                if fit.excess < self.method.search.hopeless_share * self.nominal.excess]
        best = sorted(good, key=self.odds_against)[:self.method.search.pruned_leaders]
        leaders = self.likely(best)
        pruned = [self.steps.prune(fit, self.residuals, self.nominal.excess) for fit in leaders]
        return [fit for fit in fits if fit not in leaders] + pruned

    def likely(self, fits: Sequence[Fit]) -> list[Fit]:
        """Those of some fits, best first, that the best of them does not make futile."""
        return [fit for fit in fits if self.odds_against(fit) < self.odds_against(fits[0])
                + np.log(self.method.calibration.futile_odds)]

    def is_done(self, fits: Sequence[Fit]) -> bool:
        """Whether there is no need, or no time, for further causes."""
        return self.is_explained(fits) or self.residuals.is_out_of_time

    def is_explained(self, fits: Sequence[Fit]) -> bool:
        """Whether the best fit leaves so little that no further cause could lead with it."""
        left, whole = least_excess(fits), self.nominal.excess
        small = max(self.method.calibration.healthy,
                    self.method.search.negligible_share * whole)
        return left < small or self.method.calibration.cannot_pay_off(left, whole)

    def near_the_best(self, fits: Sequence[Fit], others: Sequence[Fit] = ()) -> list[Fit]:
        """Those of some fits that are not far behind the best of them, and of others."""
        limit = pruning_limit(least_excess([*fits, *others]), self.nominal.excess, self.method)
        return [fit for fit in fits if fit.excess < limit]


def _distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The first candidate of each set of causes."""
    by_causes: dict[frozenset[str], Candidate] = {}
    for candidate in candidates:
        by_causes.setdefault(cause_keys(candidate.members), candidate)
    return list(by_causes.values())


def _new(fits: Sequence[Fit], candidates: Sequence[Candidate]) -> list[Candidate]:
    """The first candidate of each set of causes that no fit has."""
    known = {cause_keys(one.hypothesis.members) for one in fits}
    return [one for one in _distinct(candidates) if cause_keys(one.members) not in known]


def _total(fit: Fit) -> float:
    return fit.total


def _least(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=_total)


def _excess(fit: Fit) -> float:
    return fit.excess
