"""The contest of a search: what was fitted, which of it leads, and when it is over."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.acting_order import in_best_order
from clie_blocks.analysis.gap.search.alternatives import alternatives
from clie_blocks.analysis.gap.search.candidates import Candidate, cause_keys
from clie_blocks.analysis.gap.search.racing import least_excess, odds_against, pruning_limit
from clie_blocks.analysis.gap.search.steps import SearchSteps


@dataclasses.dataclass(frozen=True)
class Contest:
    """Causes that compete around a refitted nominal model.

    Parameters
    ----------
    residuals : ResidualModel
        Of the logs.
    nominal : Fit
        The refitted nominal model.
    causes : sequence of Cause
        Those to search for.
    steps : SearchSteps
        What the search is made of.
    leaders, ordered : list of Fit
        Fits whose alternatives were tried, and whose causes act in their best order.

    """

    residuals: ResidualModel
    nominal: Fit
    causes: Sequence[Cause]
    steps: SearchSteps
    leaders: list[Fit] = dataclasses.field(default_factory=list)
    ordered: list[Fit] = dataclasses.field(default_factory=list)

    @property
    def method(self) -> Method:
        """Thresholds."""
        return self.residuals.method

    def leader(self, fits: Sequence[Fit]) -> Fit:
        """The fit around which others are worth trying.

        It leads by its odds: what is near a set that does not pay its causes can hardly lead,
        either.  But one that explains a fair share of what the best leaves may be near the right
        one, which is still in a false minimum.
        """
        likeliest, closest = min(fits, key=self.odds_against), min(fits, key=_excess)
        is_fair = (likeliest.excess > self.method.calibration.healthy
                   and closest.excess < self.method.search.fair_share * likeliest.excess)
        return closest if is_fair else likeliest

    def odds_against(self, fit: Fit) -> float:
        """Odds against a fit, see `racing.odds_against`."""
        return odds_against(fit, self.nominal, self.method)

    def has_paid(self, smaller: Fit, larger: Fit) -> bool:
        """Whether a set of causes explains so much more than a smaller one as it costs."""
        calibration, whole = self.method.calibration, self.nominal.excess
        gain = (calibration.score(larger.excess, whole)
                - calibration.score(smaller.excess, whole))
        return bool(gain > calibration.cause_cost + calibration.parameter_cost)

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

    def with_distinct(self, fits: list[Fit], candidates: Sequence[Candidate]) -> list[Fit]:
        """Fits, and those of candidates with sets of causes that none of them has."""
        return self.with_raced(fits, not_fitted(fits, candidates),
                               self.method.search.pair_finalists)

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
        calibration, left, whole = self.method.calibration, least_excess(fits), self.nominal.excess
        small = max(calibration.healthy, self.method.search.negligible_share * whole)
        keeps_to_datasheet = self.nominal.penalty <= self.method.verdict.prior_violation
        return (left < small or calibration.cannot_pay_off(left, whole)
                or keeps_to_datasheet and calibration.cannot_lead(left, whole))

    def near_the_best(self, fits: Sequence[Fit], others: Sequence[Fit] = ()) -> list[Fit]:
        """Those of some fits that are not far behind the best of them, and of others."""
        limit = pruning_limit(least_excess([*fits, *others]), self.nominal.excess, self.method)
        return [fit for fit in fits if fit.excess < limit]


def distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The first candidate of each set of causes."""
    by_causes: dict[frozenset[str], Candidate] = {}
    for candidate in candidates:
        by_causes.setdefault(cause_keys(candidate.members), candidate)
    return list(by_causes.values())


def not_fitted(fits: Sequence[Fit], candidates: Sequence[Candidate]) -> list[Candidate]:
    """The first candidate of each set of causes that no fit has."""
    known = {cause_keys(one.hypothesis.members) for one in fits}
    return [one for one in distinct(candidates) if cause_keys(one.members) not in known]


def least(fits: Sequence[Fit]) -> Fit:
    """The fit of least cost."""
    return min(fits, key=total)


def total(fit: Fit) -> float:
    """Cost of a fit."""
    return fit.total


def _excess(fit: Fit) -> float:
    return fit.excess
