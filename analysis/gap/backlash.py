"""The same explanation in a loop that follows the recorded commands, in search of backlash.

A free-running model sees only the reference.  Where backlash lets a link rattle, or a loop hunts,
the noise of the sensor decides the next impact.  After some impacts model and robot have diverged,
however true the model is.  Here every model gets the command that was recorded, noise included,
and a fraction of the feedback holds it near the measured motion (`fitting.recorded_commands`).
That hides a fault of the controller: this explanation counts only where it finds backlash.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.explain import EXPLAIN_STEPS, ExplainSteps, Explanation, explain
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, residuals_of_sets
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.recorded_commands import has_feedback, with_recorded_commands
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.simulation.closed_loop import constants
from clie_blocks.analysis.gap.verdict.evidence import Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause, posterior

_LAW_PARAMETERS = ("kp", "kd", "saturation")
_NO_EXCESS = 1e-3  # excess per sample of a model that leaves nothing: no share is taken of less


def explain_backlash(first: Explanation, causes: Sequence[Cause], method: Method,
                     steps: ExplainSteps = EXPLAIN_STEPS,
                     explain: Callable[..., Explanation] = explain,
                     restart: Callable[[Fit, ResidualModel], Fit] | None = None,
                     ) -> Explanation | None:
    """Explain a problem in a softened loop where its first explanation leaves room for backlash.

    None where the first explanation stands, no time is left, or the stated loop diverges, which
    softer gains would only hide.  `explain` explains the softened problem, `restart` improves the
    fit of backlash alone, by default from many starts.
    """
    problem, table = first.residuals.problem, first.evidence
    deadline = first.residuals.deadline
    if (first.residuals.is_out_of_time or first.nominal.has_diverged
            or not _is_worthwhile(problem, table, causes, method)):
        return None
    softened, thresholds = soften_loop(problem, method), method.backlash
    method = method.with_values(**{"search.negligible_share": thresholds.negligible_share})
    alone = explain(softened, (BACKLASH,), method, _with_numbers(steps, ()),
                    test_lack_of_fit=False, deadline=deadline).evidence
    of_first = _leading_share(table, method)
    limit = (thresholds.largest_share_alone if of_first > thresholds.negligible_share
             else of_first)
    if _share(alone) > limit:
        return None
    numbers = _numbers_with_odds(table, method)
    second = explain(softened, causes, method, _with_numbers(steps, numbers), deadline=deadline)
    evidence = _with_best_backlash(second, alone, restart or multistart)
    return (dataclasses.replace(second, evidence=evidence)
            if _has_backlash(evidence, method) else None)


def _numbers_with_odds(table: Table, method: Method) -> tuple[Cause, ...]:
    """Numbers of the robot file with which a model leaves little enough to have odds."""
    limit = method.verdict.no_odds_share * table.nominal_excess
    fits = (*(row.fit for row in table.rows), *table.misdescribed)
    return tuple(member.cause for fit in fits if fit is not None and fit.excess < limit
                 for member in fit.hypothesis.members if is_number(member.cause))


def _with_numbers(steps: ExplainSteps, numbers: Sequence[Cause]) -> ExplainSteps:
    """Steps that fit no other numbers of the robot file than some."""
    every = steps.search.wrong_numbers

    def some(problem: Problem) -> list[Member]:
        return [member for member in every(problem) if member.cause in numbers]

    return dataclasses.replace(steps, search=dataclasses.replace(steps.search, wrong_numbers=some))


def _with_best_backlash(second: Explanation, alone: Table,
                        restart: Callable[[Fit, ResidualModel], Fit]) -> Table:
    """Evidence with the best fit of backlash alone."""
    table, names = second.evidence, (BACKLASH.name,)
    rows = [row for row in (*table.rows, *alone.rows) if row.names == names]
    fits = [(row.excess, row.fit) for row in rows if row.fit is not None]
    _, start = min(fits, key=lambda pair: pair[0])
    best = restart(start, second.residuals)
    row = dataclasses.replace(rows[0], excess=float(best.excess), fit=best)
    others = [other for other in table.rows if other.names != names]
    return dataclasses.replace(table, rows=[row, *others])


def multistart(backlash: Fit, residuals: ResidualModel) -> Fit:
    """Return the best of a fit of backlash alone and of others that start around it.

    Each impact that appears or disappears is a ridge in the misfit, and a fit stops before the
    next one.
    """
    starts = _starts_around(backlash.hypothesis, residuals)
    sets = [start.values for start in starts]
    costs = sum((part**2).sum(axis=1)
                for of_log in residuals_of_sets(backlash.hypothesis, sets, residuals)
                for part in of_log)
    best = np.argsort(costs)[:residuals.method.backlash.restarts]
    fits = [fit(starts[i], residuals) for i in best]
    return min([backlash, *fits], key=lambda one: one.total)


def _starts_around(hypothesis: Hypothesis, residuals: ResidualModel) -> list[Hypothesis]:
    """Hypotheses of backlash with other gaps and other contact stiffnesses."""
    values, thresholds = hypothesis.values, residuals.method.backlash
    gap, contact = (f"{BACKLASH.block}.{name}" for name in ("half_gap", "contact"))
    return [hypothesis.with_values({**values, gap: ratio * values[gap],
                                    contact: stiffness + 0.0 * values[contact]})
            for ratio in thresholds.start_gaps for stiffness in thresholds.start_contacts]


def to_stated_loop(ranking: Sequence[RankedCause], model: Fit, problem: Problem,
                   ) -> tuple[list[RankedCause], Fit]:
    """Return a ranking and a fit of the softened loop as models in the loop of a problem."""
    moved = [ranked if ranked.fit is None
             else dataclasses.replace(ranked, fit=_in_loop_of(problem, ranked.fit))
             for ranked in ranking]
    return moved, _in_loop_of(problem, model)


def _in_loop_of(problem: Problem, model: Fit) -> Fit:
    """Fit in the stated loop of a problem, on the logs that it was fitted to."""
    stated, hypothesis = constants(problem), model.hypothesis
    count = len(hypothesis.problem.fit)
    problem = dataclasses.replace(problem, fit=problem.logs[:count], held_out=problem.logs[count:])
    values = {**hypothesis.values, **{key: stated[key] for key in _LAW_PARAMETERS}}
    return dataclasses.replace(
        model, hypothesis=dataclasses.replace(hypothesis, problem=problem, values=values))


def soften_loop(problem: Problem, method: Method) -> Problem:
    """Return the problem of models that follow the recorded commands."""
    thresholds = method.backlash
    return with_recorded_commands(problem, thresholds.stiffness_share, thresholds.damping_share)


def _is_worthwhile(problem: Problem, table: Table, causes: Sequence[Cause], method: Method,
                   ) -> bool:
    """Whether a loop with feedback leaves something that may be backlash."""
    leading = posterior(table, method.calibration)[0].names
    right = max(method.backlash.right_share,
                method.calibration.healthy / max(table.nominal_excess, _NO_EXCESS))
    return (BACKLASH in causes and has_feedback(problem) and not problem.quiet
            and leading != (BACKLASH.name,) and _share(table) > right)


def _share(table: Table) -> float:
    """Share of the excess that the best hypothesis leaves."""
    whole = max(table.nominal_excess, _NO_EXCESS)
    return min([1.0, *(row.excess / whole for row in table.rows if not row.confounder)])


def _leading_share(table: Table, method: Method) -> float:
    """Share that the most probable hypothesis leaves; all, where that is no cause."""
    excess = {row.names: row.excess for row in table.rows if not row.confounder}
    leading = posterior(table, method.calibration)[0].names
    whole = max(table.nominal_excess, _NO_EXCESS)
    return excess.get(leading, table.nominal_excess) / whole


def _has_backlash(table: Table, method: Method) -> bool:
    """Whether the most probable hypothesis contains backlash."""
    return BACKLASH.name in posterior(table, method.calibration)[0].names
