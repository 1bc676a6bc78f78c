"""What a verdict rests on: one row per hypothesis, in figures that can be stored and read again.

The excess is chi^2 beyond the noise, per sample of one joint, with the price of the parameters.
Nothing here depends on the calibration, so tables of many robots can be ranked anew in no time;
which pairs were fitted at all does, where a further cause could not have paid off.
"""

import dataclasses
from collections.abc import Callable, ItemsView, Mapping
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.causes.description import is_number
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.nesting import repeats_simulator, simpler_names
from clie_blocks.analysis.gap.fitting.parameter_count import parameter_count
from clie_blocks.analysis.gap.fitting.prediction_error import gap
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.confounders import confounder, imitated_causes


@dataclasses.dataclass(frozen=True, eq=False)
class Row:
    """The evidence on one hypothesis with causes; it holds no probability, see `RankedCause`.

    Parameters
    ----------
    names : tuple of str
        Its causes, sorted.
    excess : float
        What it leaves, see `evidence`.
    parameter_count : float
        Parameters that it spends beyond the joint model, see `parameter_count`.
    prior_violations : int
        Parameters of its joint model beyond the datasheet; 0 where they are no more than noise.
    confounder : str
        The effect outside the library that the logs do not tell from it, or empty, see
        `confounder`.
    prior_violation : float
        Share of the excess that comes from parameters beyond the datasheet.
    imitated : tuple of str
        The causes among its own in whose place the confounder may be.
    fit : Fit or None
        The fit, if it is at hand.

    """

    names: tuple[str, ...]
    excess: float
    parameter_count: float
    prior_violations: int = 0
    confounder: str = ""
    prior_violation: float = 0.0
    imitated: tuple[str, ...] = ()
    fit: Fit | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """All evidence on one robot.

    Parameters
    ----------
    nominal_excess : float
        Excess of the refitted nominal model, see `evidence`.
    prior_violation : float
        Its share that comes from parameters beyond the datasheet.
    prior_violations : int
        Parameters beyond the datasheet; 0 where they are no more than noise.
    free : tuple of float
        Excess with a torque that is free to depend on pose, speed and load, on logs that it was
        not fitted to: added to the refitted nominal model, to the best hypothesis, and to the
        best one with a single cause, which has absorbed less; empty where it was not fitted.
    rows : list of Row
        The best variant of each set of causes, separately for each confounder.
    nominal : Fit or None
        The refitted nominal model, if it is at hand.
    misdescribed : tuple of Fit
        Fits that contradict the robot file, if they are at hand: of the rows of one set of names
        each holds another number of it.

    """

    nominal_excess: float
    prior_violation: float
    prior_violations: int
    free: tuple[float, ...]
    rows: list[Row]
    nominal: Fit | None = None
    misdescribed: tuple[Fit, ...] = ()


def to_json(table: Table) -> dict[str, Any]:
    """Table as plain types, without the fits."""
    return {"nothing": table.nominal_excess, "stray": table.prior_violation,
            "strayed": table.prior_violations, "free": list(table.free),
            "rows": [[list(row.names), row.excess, row.parameter_count, row.prior_violations,
                      row.confounder, row.prior_violation, list(row.imitated)]
                     for row in table.rows]}


def from_json(stored: Mapping[str, Any]) -> Table:
    """Table from `to_json`."""
    rows = [Row(tuple(names), *figures[:5], *map(tuple, figures[5:]))
            for names, *figures in stored["rows"]]
    return Table(stored["nothing"], stored["stray"], stored["strayed"], tuple(stored["free"]),
                 rows)


def evidence(nominal: Fit, fits: list[Fit], residuals: ResidualModel) -> Table:
    """Return the table of the refitted nominal model and of fitted hypotheses with causes.

    A model leaves its excess; where the gap contradicts that of the nominal model, it leaves its
    `gap_beyond_noise`, if that is more.  The table comes without a free torque, and hypotheses
    far behind the best one come without a confounder.
    """
    method, contradicted = residuals.method.verdict, is_contradicted(nominal, residuals)

    def left_by(fit: Fit, forgiven: float = 0.0) -> float:
        excess = fit.excess - forgiven
        return float(max(excess, gap_beyond_noise(fit, residuals)) if contradicted else excess)

    def from_violation(fit: Fit) -> float:
        return left_by(fit) - left_by(fit, fit.penalty / samples_per_joint)

    samples_per_joint = nominal.samples.sum() / nominal.hypothesis.problem.n
    nominal_excess = left_by(nominal)
    limit = _far_behind(min(map(left_by, fits), default=0.0), nominal_excess,
                        residuals.method)
    best = {}
    for names, same in _by_names(fits).items():
        for confounded, fit in _variants(same, lambda one: left_by(one) < limit, residuals):
            best[names, confounded] = fit
    rows = [Row(names, left_by(fit), parameter_count(fit), prior_violations(fit, method),
                confounded, from_violation(fit),
                imitated_causes(fit, residuals) if confounded else (), fit)
            for (names, confounded), fit in best.items()
            if (simpler_names(fit, residuals.method), confounded) not in best
            and not repeats_simulator(fit, residuals.method)]
    misdescribed = tuple(fit for fit in (nominal, *fits) if contradictions(fit, method))
    return Table(nominal_excess, float(nominal.penalty / samples_per_joint),
                 prior_violations(nominal, method), (), rows, nominal, misdescribed)


def is_contradicted(nominal: Fit, residuals: ResidualModel) -> bool:
    """Whether the gap of a model is far above its floor though it leaves little excess.

    The excess forgives what an unknown initial state would do.  Where that state is stated, with
    the robot at rest, there is nothing to forgive: a link that falls through its backlash does so
    just then.
    """
    problem, limit = residuals.problem, residuals.method.verdict.contradicting_gap
    return (not problem.quiet and all(log.at_rest for log in problem.logs)
            and gap_beyond_noise(nominal, residuals) > max(nominal.excess, limit))


def gap_beyond_noise(fit: Fit, residuals: ResidualModel) -> float:
    """Squared gap on the validation logs over that of sensor noise, less one."""
    floor = sum(residuals.floors**2)
    return gap(fit.hypothesis)**2 / floor - 1.0


def prior_violations(fit: Fit, method: VerdictMethod) -> int:
    """Parameters of the joint model beyond the datasheet; 0 where they are no more than noise."""
    if fit.penalty <= method.prior_violation:
        return 0
    return int(np.sum(fit.prior_violation != 0.0))


def contradictions(fit: Fit, method: VerdictMethod) -> int:
    """Kinds of numbers of the robot file that a fit contradicts; those of the drives are one."""
    numbers = sum(is_number(member.cause) for member in fit.hypothesis.members)
    return numbers + bool(prior_violations(fit, method))


def _far_behind(least: float, nominal_excess: float, method: Method) -> float:
    """Excess from which a hypothesis has no odds, given the least of all."""
    verdict = method.verdict
    significant = max(least, verdict.negligible_excess_share * nominal_excess,
                      method.calibration.healthy)
    return min(verdict.no_odds_factor * significant, verdict.no_odds_share * nominal_excess)


def _by_names(fits: list[Fit]) -> dict[tuple[str, ...], list[Fit]]:
    """Fits by the names of their causes, the best first; without those that repeat a name."""
    fits_of: dict[tuple[str, ...], list[Fit]] = {}
    for fit in sorted(fits, key=lambda one: one.total):
        names = tuple(sorted(member.cause.name for member in fit.hypothesis.members))
        if len(set(names)) == len(names):
            fits_of.setdefault(names, []).append(fit)
    return fits_of


def _variants(fits: list[Fit], is_near: Callable[[Fit], bool], residuals: ResidualModel,
              ) -> ItemsView[str, Fit]:
    """Best of some fits of the same causes by its confounder, then that with another or none."""
    best = {confounder(fits[0], residuals) if is_near(fits[0]) else "": fits[0]}
    for fit in fits[1:] if any(best) else ():
        if is_near(fit):
            best.setdefault(confounder(fit, residuals), fit)
    return best.items()
