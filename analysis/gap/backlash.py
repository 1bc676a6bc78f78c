"""The same explanation in a loop that follows the recorded commands, in search of backlash.

A free-running model sees only the reference.  Where backlash lets a link rattle, or a loop hunts,
the noise of the sensor decides the next impact, and after some of them model and robot have
parted, however true the model is.  Here every model gets the command that was recorded, noise and
all, and a fraction of the feedback holds it near the measured motion,

    u = u_log + kp' (q_log - q) + kd' F (q_log - q),    kp' < kp,  kd' < kd.

That is the law (11) again, with softer gains and another excitation, so every stage runs on it as
it is, and what a linear model leaves is the same in both loops once it is whitened.  Recorded
commands hide a fault of the controller: this explanation counts only where it finds backlash.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.explain import EXPLAIN_STEPS, ExplainSteps, Explanation, explain
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import Fit, fit
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.simulation.closed_loop import constants
from clie_blocks.analysis.gap.verdict.evidence import Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause, posterior

TINY = 1e-3  # excess that is none
OF_LAW = "kp", "kd", "saturation"


def explain_backlash(first: Explanation, causes: Sequence[Cause], method: Method,
                     steps: ExplainSteps = EXPLAIN_STEPS,
                     explain: Callable[..., Explanation] = explain,
                     restart: Callable[[Fit, ResidualModel], Fit] | None = None,
                     ) -> Explanation | None:
    """Explain a problem in a softened loop where it leaves something that may be backlash.

    None where the first explanation stands.  `explain` explains the softened problem, `restart`
    improves the fit of backlash alone, by default from many starts.
    """
    problem, table = first.residuals.problem, first.evidence
    if not _is_worthwhile(problem, table, causes, method):
        return None
    soft, thresholds = soften_loop(problem, method), method.backlash
    method = method.with_values(**{"search.negligible_share": thresholds.negligible_share})
    alone = explain(soft, (BACKLASH,), method, steps, test_lack_of_fit=False).evidence
    left = _leading_share(table, method)
    if _share(alone) > (thresholds.largest_share_alone if left > thresholds.negligible_share
                         else left):
        return None
    second = explain(soft, causes, method, steps)
    evidence = _with_best_backlash(second, alone, restart or multistart)
    return (dataclasses.replace(second, evidence=evidence)
            if _has_backlash(evidence, method) else None)


def _with_best_backlash(second: Explanation, alone: Table,
                        restart: Callable[[Fit, ResidualModel], Fit]) -> Table:
    """Evidence with the best fit of backlash alone."""
    table = second.evidence
    of_backlash = [row for row in (*table.rows, *alone.rows) if row.names == (BACKLASH.name,)]
    best = restart(min(of_backlash, key=lambda row: row.excess).fit, second.residuals)
    row = dataclasses.replace(of_backlash[0], excess=float(best.excess), fit=best)
    return dataclasses.replace(table, rows=[row, *(other for other in table.rows
                                                   if other.names != row.names)])


def multistart(backlash: Fit, residuals: ResidualModel) -> Fit:
    """Return the best of a fit of backlash alone and of others that start around it.

    Each impact that comes or goes is a ridge in the misfit, and a fit stops before the next one.
    """
    at, thresholds = backlash.hypothesis, residuals.method.backlash
    gap, contact = (f"{BACKLASH.block}.{name}" for name in ("half_gap", "contact"))
    starts = [at.with_values({**at.values, gap: wider * at.values[gap],
                              contact: flank + 0.0 * at.values[contact]})
              for wider in thresholds.start_gaps for flank in thresholds.start_contacts]
    costs = sum((part**2).sum(axis=1) for j in range(len(at.problem.fit))
                for part in residuals.of_runs(at.means(j, [s.values for s in starts]), j))
    again = [fit(starts[i], residuals) for i in np.argsort(costs)[:thresholds.restarts]]
    return min([backlash, *again], key=lambda one: one.total)


def to_stated_loop(ranking: Sequence[RankedCause], model: Fit, problem: Problem,
                   ) -> tuple[list[RankedCause], Fit]:
    """Return a ranking and a fit of the softened loop as models in the loop of a problem."""
    stated = constants(problem)

    def moved(fit: Fit) -> Fit:
        at, fitted = fit.hypothesis, len(fit.hypothesis.problem.fit)
        same = dataclasses.replace(problem, fit=problem.logs[:fitted],
                                   held_out=problem.logs[fitted:])
        values = {**at.values, **{key: stated[key] for key in OF_LAW}}
        return dataclasses.replace(fit, hypothesis=dataclasses.replace(at, problem=same,
                                                                       values=values))

    return [dataclasses.replace(one, fit=None if one.fit is None else moved(one.fit))
            for one in ranking], moved(model)


def soften_loop(problem: Problem, method: Method) -> Problem:
    """Return the problem of models that follow the recorded commands."""
    thresholds = method.backlash
    law = dataclasses.replace(problem.law, kp=thresholds.stiffness_share * problem.law.kp,
                              kd=thresholds.damping_share * problem.law.kd,
                              saturation=np.full(problem.n, np.inf))
    soft = problem.with_logs(lambda log: _with_recorded_commands(log, law))
    return dataclasses.replace(soft, law=law, quiet=True)


def _with_recorded_commands(log: Log, law: StatedLaw) -> Log:
    """Log whose excitation is its command, with the feedback of the measured motion."""
    excitation = log.u + law.kp * log.q + law.kd * law.rate(log.q)
    return dataclasses.replace(log, q_d=np.zeros_like(log.q), pe=excitation,
                               dither=np.zeros_like(log.q))


def _is_worthwhile(problem: Problem, table: Table, causes: Sequence[Cause], method: Method,
                   ) -> bool:
    law, leading = problem.law, posterior(table, method.calibration)[0].names
    feedback = bool(np.all(law.kp > 0) and np.all(law.kd > 0))
    return (BACKLASH in causes and feedback and not problem.quiet
            and leading != (BACKLASH.name,) and _share(table) * table.nominal_excess > method.backlash.least_excess)


def _share(table: Table) -> float:
    """Share of the excess that the best hypothesis leaves."""
    whole = max(table.nominal_excess, TINY)
    return min([1.0, *(row.excess / whole for row in table.rows if not row.confounder)])


def _leading_share(table: Table, method: Method) -> float:
    """Share that the most probable hypothesis leaves; all, where that is no cause."""
    left = {row.names: row.excess for row in table.rows if not row.confounder}
    leading = posterior(table, method.calibration)[0].names
    return left.get(leading, table.nominal_excess) / max(table.nominal_excess, TINY)


def _has_backlash(table: Table, method: Method) -> bool:
    """Whether the most probable hypothesis holds backlash."""
    return BACKLASH.name in posterior(table, method.calibration)[0].names
