"""The search for causes: one alone, then two, then one more at a time while much is left."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.drive import TORQUE_GAIN_ERROR
from clie_blocks.analysis.gap.causes.load import COUPLING
from clie_blocks.analysis.gap.fitting.compile_ahead import compiler
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import is_long
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.along_motion import (
    following_problem,
    in_stated_loop,
    within_share_of_time,
)
from clie_blocks.analysis.gap.search.alternatives import FEW
from clie_blocks.analysis.gap.search.candidates import (
    Candidate,
    cause_keys,
    extensions,
    fitted_members,
    of_each_joint,
)
from clie_blocks.analysis.gap.search.contest import Contest, distinct, least, not_fitted, total
from clie_blocks.analysis.gap.search.fewer import with_other_delays, without_idle_causes
from clie_blocks.analysis.gap.search.file_numbers import (
    number_beside,
    with_coupled_number,
    with_swapped_number,
)
from clie_blocks.analysis.gap.search.further_causes import (
    first_pairs,
    one_exchanged,
    one_more_cause,
    two_more_causes,
)
from clie_blocks.analysis.gap.search.joint_by_joint import fit_joint_by_joint
from clie_blocks.analysis.gap.search.racing import (
    least_excess,
    leaves_much,
    predicted_excess,
    worth_extending,
)
from clie_blocks.analysis.gap.search.screening import Screen
from clie_blocks.analysis.gap.search.simpler import simpler_candidates
from clie_blocks.analysis.gap.search.steps import SEARCH_STEPS, SearchSteps
from clie_blocks.errors import DivergedError


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
    with compiler(is_long(residuals)):
        screen = steps.screen(residuals, nominal, causes)
        fits = search.with_wrong_numbers(screen, search.fits_of_causes(screen))
        is_complete = not residuals.is_out_of_time
        improved = search.with_neighbours(screen, fits)
        if improved and search.leader(improved) not in fits:
            improved = search.with_wrong_numbers(screen, improved)
        fits = search.finish_leader(search.with_simpler(improved))
    return SearchResult(fits, is_complete)


@dataclasses.dataclass(frozen=True)
class _Search(Contest):
    """A search for causes: the order in which sets of them are fitted.

    Those of `settled` are the fits whose neighbours were tried.
    """

    settled: list[Fit] = dataclasses.field(default_factory=list)

    def with_wrong_numbers(self, screen: Screen, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of numbers of the robot file, alone and with one cause more."""
        method, members = self.method.search, self.steps.wrong_numbers(self.residuals.problem)
        if not members or self.residuals.is_out_of_time:
            return fits
        of_causes = self.near_the_best(sorted(fits, key=self.odds_against)[:method.described_fits])
        alone = sorted(self.fits_of_numbers([(member,) for member in members]), key=total)
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
                for candidate in one_more_cause(self, screen, fit)]
        more += [number_beside(fit, member, self.residuals) for fit in of_causes
                 for member in members if not self.residuals.is_out_of_time]
        worth = [candidate for candidate in distinct(more)
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
        gains = self.gains_beside(self.nominal)  # first, for they are soon fitted
        alone = self.steps.singles(screen, self.residuals, self.nominal, self.causes)
        alone = alone[:method.leaders]
        if not alone:  # all of the causes need links that are not stated
            return []
        fits = self.with_singles(gains, alone)
        if self.is_done(fits) or len(self.causes) == 1:
            return fits
        best = least(fits)
        along = self.sets_along_motion(best)
        if along and least(along).excess < best.excess:
            fits = self.with_pruned([*fits, *along])
        else:
            fits = self.with_joint_by_joint(screen, self.nominal, fits)
            fits = self.with_links(screen, fits)
        if self.needs_several(best, least(fits)):
            fits = self.grown_from_what_is_needed(
                screen, self.grown_while_paid(screen, fits, [], least))
        if self.has_paid(best, least(fits)):
            return self.with_larger_sets(screen, fits, [])
        extended = self.near_the_best(sorted(fits, key=self.odds_against)[:method.extended_fits])
        fits = self.with_raced(fits, first_pairs(self, screen, alone, fits, extended),
                               method.pair_finalists)
        if not self.is_done(fits) and not self.has_paid(best, least(fits)):
            fits = self.with_two_more(screen, extended, fits)
        return self.with_larger_sets(screen, fits, extended)

    def with_singles(self, fits: list[Fit], alone: list[Candidate]) -> list[Fit]:
        """Fits, and those of single causes.

        Where none explains most of the gap of an arm of many joints, what each joint needs says
        more than the last steps of these fits, or their alternatives.
        """
        method = self.method.search
        fits = self.with_fitted(fits, alone, method.single_finalists)
        if is_long(self.residuals) and leaves_much(least(fits), self.nominal, self.method):
            return fits
        return self.with_raced(fits, [], method.single_finalists)

    def gains_beside(self, base: Fit) -> list[Fit]:
        """Fits of a wrong gain of one drive of an arm beside the causes of a fit."""
        return (self.steps.drive_gains(base, self.residuals)
                if TORQUE_GAIN_ERROR in self.causes else [])

    def sets_along_motion(self, alone: Fit) -> list[Fit]:
        """Sets of causes that are found along the measured motion, fitted in the stated loop.

        Where the best single cause leaves much of a gap, linear predictions in the stated loop say
        little, and fits end in false minima.  On arms of many joints the time does not suffice for
        two searches.
        """
        method = self.method.search
        following = following_problem(self.residuals.problem, method)
        if (following is None or is_long(self.residuals)
                or alone.excess < method.following_share * self.nominal.excess):
            return []
        try:
            residuals, nominal = fit_nominal(following, self.method)
            inner = _Search(within_share_of_time(residuals, self.residuals), nominal, self.causes,
                            self.steps)
            fits = inner.fits_of_causes(self.steps.screen(inner.residuals, nominal, self.causes))
        except DivergedError:  # joints push each other, though the loop of each is stable
            return []
        if least([nominal, *fits]).excess > method.following_left * nominal.excess:
            return []
        sets = [one for one in sorted(fits, key=inner.odds_against)
                if len(one.hypothesis.members) > 1]
        chosen = list(dict.fromkeys([*inner.likely(sets)[:method.following_sets], least(fits)]))
        return [in_stated_loop(one, self.residuals) for one in chosen]

    def needs_several(self, alone: Fit, together: Fit) -> bool:
        """Whether one cause leaves much, and a set with some at several joints leaves less.

        Then pairs are no nearer than that set, from which the search goes on.
        """
        return (len(together.hypothesis.members) > 1
                and leaves_much(alone, self.nominal, self.method))

    def with_two_more(self, screen: Screen, bases: Sequence[Fit], fits: list[Fit]) -> list[Fit]:
        """Fits, and those of some of them with two causes more, where one more has not paid.

        Causes that make up for one another, such as friction and drag beside a damping that was
        refitted, show together alone.
        """
        more = [candidate for base in bases for candidate in two_more_causes(self, screen, base)]
        return self.with_fitted(fits, not_fitted(fits, sorted(more, key=lambda one: -one.score)),
                                self.method.search.pair_finalists)

    def with_larger_sets(self, screen: Screen, fits: list[Fit], extended: Sequence[Fit],
                         ) -> list[Fit]:
        """Fits, and those of larger sets around the likeliest one, and around that of least cost.

        Where much is left the odds of few causes may lead, though each more would pay.
        """
        extended = list(extended)
        for best_of in (self.leader, least):
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
        return self.grown_while_paid(screen, fits, extended, best_of)

    def grown_while_paid(self, screen: Screen, fits: list[Fit], extended: list[Fit],
                         best_of: Callable[[Sequence[Fit]], Fit]) -> list[Fit]:
        """Fits, and those of the best one with more causes, without alternatives in between."""
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

    def grown_from_what_is_needed(self, screen: Screen, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of the best set without idle causes, and with others in their place.

        What the best cause of a joint explained, a later one may explain; but a set that is full
        takes none.
        """
        if self.is_done(fits):
            return fits
        smaller = without_idle_causes(least(fits), fits, self.nominal, self.residuals)
        if not smaller:
            return fits
        return self.grown_while_paid(screen, self.with_pruned([*fits, *smaller]), [], self.leader)

    def grown(self, screen: Screen, base: Fit, fits: list[Fit]) -> Iterator[list[Fit]]:
        """Fits, and with each step more sets that are larger than a base, the likeliest first."""
        method, more = self.method.search, one_more_cause(self, screen, base)
        of_links = [one for one in more if one.members[-1].cause.changes_links]
        fits = self.with_fitted(fits + self.gains_beside(base), of_links, len(of_links))
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

    def with_links(self, screen: Screen, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of the best set of causes beside what changes the links of all joints.

        A payload alone explains next to nothing of what causes at single joints leave, though it
        may cost most.
        """
        base = least(fits)
        if self.is_done(fits) or len(base.hypothesis.members) < 2:
            return fits
        of_links = [column for column in screen.columns if column.cause.changes_links]
        left = self.steps.screen_residual(dataclasses.replace(screen, columns=of_links),
                                          self.residuals, base)
        more = list(extensions(base, self.steps.singles(left, self.residuals, base, ())))
        return self.with_fitted(fits, more, len(more))

    def with_simpler(self, fits: list[Fit]) -> list[Fit]:
        """Fits, and those of the likely ones whose causes have shrunk to simpler ones."""
        likely = self.likely(sorted(fits, key=self.odds_against)) if fits else []
        simpler = distinct(simpler_candidates(likely, fits, self.causes, self.residuals))
        return fits if not simpler else fits + self.steps.race(
            self.residuals, self.nominal, simpler, len(simpler))

    def finish_leader(self, fits: list[Fit]) -> list[Fit]:
        """Fits, and the leader without idle causes and with other delays, if the time is over."""
        if not fits or not self.residuals.is_out_of_time:
            return fits
        fits = fits + without_idle_causes(self.leader(fits), fits, self.nominal, self.residuals)
        return fits + with_other_delays(self.leader(fits), fits, self.causes, self.residuals)

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
                fits = self.with_distinct(fits, one_more_cause(self, screen, leader))
            if self.leader(fits) is leader:
                fits = self.with_distinct(fits, one_exchanged(self, screen, leader))
        return fits
