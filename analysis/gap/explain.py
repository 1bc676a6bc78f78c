"""Explain a problem: fit the nominal model, and the hypotheses that are worth a fit."""

import dataclasses
import math
from collections.abc import Callable, Sequence

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal, pool_logs
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import Noise, sensor_noise_model
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.noise_of_leader import with_noise_of_leader
from clie_blocks.analysis.gap.search.steps import SEARCH_STEPS, SearchSteps
from clie_blocks.analysis.gap.search.strategy import SearchResult, search_causes
from clie_blocks.analysis.gap.verdict.evidence import Table, evidence
from clie_blocks.analysis.gap.verdict.lack_of_fit import excess_with_free_torque


@dataclasses.dataclass(frozen=True)
class ExplainSteps:
    """The functions that an explanation is made of: each can be timed, or swapped for another."""

    noise_model: Callable[..., Noise] = sensor_noise_model
    fit_nominal: Callable[..., tuple[ResidualModel, Fit]] = fit_nominal
    search: SearchSteps = SEARCH_STEPS
    evidence: Callable[[Fit, list[Fit], ResidualModel], Table] = evidence
    lack_of_fit: Callable[[Fit, ResidualModel], float] = excess_with_free_torque


EXPLAIN_STEPS = ExplainSteps()


@dataclasses.dataclass(frozen=True, eq=False)
class Explanation:
    """The refitted nominal model, and the evidence on all hypotheses that were fitted.

    It is complete unless the time was over before the search was.  Where held-out logs were
    fitted, too, `before_pooling` is the nominal model on the stated split.
    """

    residuals: ResidualModel
    nominal: Fit
    evidence: Table
    is_complete: bool = True
    before_pooling: Fit | None = None

    @property
    def has_gap(self) -> bool:
        """Whether the refitted nominal model leaves what a healthy robot does not."""
        return has_gap(self.nominal, self.residuals.method)


def has_gap(nominal: Fit, method: Method) -> bool:
    """Whether a refitted nominal model leaves what a healthy robot does not."""
    return bool(nominal.excess > method.calibration.healthy
                or nominal.penalty > method.verdict.prior_violation)


def explain(problem: Problem, causes: Sequence[Cause] = CAUSES, method: Method = METHOD,
            steps: ExplainSteps = EXPLAIN_STEPS, test_lack_of_fit: bool = True,
            deadline: float = math.inf) -> Explanation:
    """Fit the nominal model and the hypotheses that are worth a fit.

    Without the test of lack of fit, the evidence does not cover an unknown effect.  The search
    ends at the deadline, a reading of `time.monotonic` [s].
    """
    residuals, nominal = steps.fit_nominal(problem, method, steps.noise_model)
    before_pooling, pooled = None, pool_logs(problem, nominal, method)
    if pooled is not problem:
        before_pooling = nominal
        residuals, nominal = steps.fit_nominal(pooled, method, steps.noise_model)
    residuals = dataclasses.replace(residuals, deadline=deadline)
    is_searched = has_gap(nominal, method) and causes and not nominal.has_diverged
    fits, is_complete = (search_causes(residuals, nominal, causes, steps.search)
                         if is_searched else SearchResult([], True))
    residuals, fits = with_noise_of_leader(residuals, nominal, fits)
    table = steps.evidence(nominal, fits, residuals)
    if not test_lack_of_fit:
        return Explanation(residuals, nominal, table, is_complete, before_pooling)
    candidates = [row.fit for row in table.rows if row.fit is not None and not row.confounder]
    free = _excess_with_free_torque(nominal, candidates, residuals, steps)
    return Explanation(residuals, nominal, dataclasses.replace(table, free=free), is_complete,
                       before_pooling)


def _excess_with_free_torque(nominal: Fit, fits: Sequence[Fit], residuals: ResidualModel,
                             steps: ExplainSteps) -> tuple[float, ...]:
    """Excess with a free torque: of the nominal model, of the best fit and of the best single.

    Empty where the best fit leaves nothing.
    """
    best = min(fits, key=_excess, default=None)
    if best is None or best.excess < residuals.method.calibration.healthy:
        return ()
    single = min((fit for fit in fits if len(fit.hypothesis.members) == 1), key=_excess,
                 default=best)
    of_best = steps.lack_of_fit(best, residuals)
    of_single = of_best if single is best else steps.lack_of_fit(single, residuals)
    return steps.lack_of_fit(nominal, residuals), of_best, of_single


def _excess(fit: Fit) -> float:
    return fit.excess
