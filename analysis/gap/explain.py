"""The diagnosis of one robot: all stages in their order."""

import dataclasses

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess, has_diverged
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal, pool_logs
from clie_blocks.analysis.gap.search.racing import QUIET
from clie_blocks.analysis.gap.search.strategy import SMALL, search_causes
from clie_blocks.analysis.gap.verdict.evidence import STRAYED, evidence
from clie_blocks.analysis.gap.verdict.lack_of_fit import excess_with_free_torque


def explain(asked, causes=CAUSES, small=SMALL, whole=True):
    """Fit the nominal model and all hypotheses worth it.

    Parameters
    ----------
    asked : Problem
        The logs, with the law that ran.
    causes : sequence of Cause
        What to look for.
    small : float
        Share of the excess that is as good as nothing, see `explore`.
    whole : bool
        Test what is left, too, without which the evidence says nothing of the unknown.

    Returns
    -------
    bench : Bench
        Noise and whitening.
    base : Fit
        The refitted nominal model.
    table : Table
        The evidence.

    """
    bench, base = fit_nominal(asked)
    learned_on = pool_logs(asked, base)
    if learned_on is not asked:
        bench, base = fit_nominal(learned_on)
    ailing = excess(base) > QUIET or base.penalty > STRAYED
    fits = search_causes(bench, base, causes, small) if ailing and causes and not has_diverged(base) else []
    table = evidence(base, fits, bench)
    free = _excess_with_free_torque(base, [row.fit for row in table.rows if not row.rival], bench) if whole else ()
    return bench, base, dataclasses.replace(table, free=free)


def _excess_with_free_torque(base, fits, bench):
    """What a free torque would leave, where even the best hypothesis leaves something."""
    best = min(fits, key=excess, default=None)
    if best is None or excess(best) < QUIET:
        return ()
    alone = min((f for f in fits if len(f.hypothesis.members) == 1), key=excess, default=best)
    beside = excess_with_free_torque(best, bench)
    return (excess_with_free_torque(base, bench), beside,
            beside if alone is best else excess_with_free_torque(alone, bench))
