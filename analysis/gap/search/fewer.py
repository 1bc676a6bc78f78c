"""The leading set without the causes that it does not need, where a search had to stop.

A set grows by one cause after the other, and what one of them explained another may explain later.
Such a cause is left out by the alternatives of each leader; when the time is over these were not
tried, and a name that explains nothing would stand in the answer.
"""

import dataclasses
import time
from collections.abc import Collection, Iterator

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.alternatives import holds_its_coupling
from clie_blocks.analysis.gap.search.candidates import cause_keys, fitted_members
from clie_blocks.analysis.gap.search.racing import is_needed, odds_against, predicted_loss

_TRIED = 2  # causes of a leader that are left out in turn, those that seem to matter least
_STEPS = 4  # of a fit that starts next to where it ends


def without_idle_causes(leader: Fit, fits: Collection[Fit], nominal: Fit,
                        residuals: ResidualModel) -> list[Fit]:
    """Return sets that are likelier than a leader, each with one cause less than that before.

    They start from the parameters of the leader; sets that were fitted already are left out.

    Parameters
    ----------
    leader : Fit
        Of several causes.
    fits : collection of Fit
        All that were fitted.
    nominal : Fit
        The refitted nominal model.
    residuals : ResidualModel
        Of the logs; the time may be over, of which this takes some seconds more.

    """
    method = residuals.method
    in_time = dataclasses.replace(
        residuals, deadline=time.monotonic() + method.search.idle_seconds)
    known, likelier = {cause_keys(one.hypothesis.members) for one in fits}, list[Fit]()
    smaller: Fit | None = leader
    while smaller is not None:
        limit = odds_against(smaller, nominal, method)
        smaller = next((one for one in _smaller(smaller, known, nominal, in_time)
                        if odds_against(one, nominal, method) < limit), None)
        likelier += [] if smaller is None else [smaller]
    return likelier


def _smaller(leader: Fit, known: Collection[frozenset[str]], nominal: Fit,
             residuals: ResidualModel) -> Iterator[Fit]:
    """Fits of a leader without one cause, that which it seems to need least first."""
    members = fitted_members(leader.hypothesis)
    parts = [(*members[:k], *members[k + 1:]) for k in range(len(members))]
    possible = [part for part in parts if part and holds_its_coupling(part)
                and cause_keys(part) not in known
                and not is_needed(leader, part, nominal, residuals.method)]
    for part in sorted(possible, key=lambda part: predicted_loss(leader, part))[:_TRIED]:
        start = build_hypothesis(residuals.problem, part, leader.hypothesis)
        yield fit(start, residuals, _STEPS, lender(leader, residuals.method.fitting))
