"""The leading set where a search had to stop: without idle causes, and with other delays.

A set grows by one cause after the other, and what one of them explained another may explain later.
Such a cause is left out by the alternatives of each leader, which also try a lag for a delay; when
the time is over these were not tried, and a name that explains nothing, or the wrong one of two
that are nearly alike, would stand in the answer.
"""

import dataclasses
import time
from collections.abc import Collection, Iterator, Sequence

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.alternatives import holds_its_coupling, other_delays
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


def with_other_delays(leader: Fit, fits: Collection[Fit], causes: Sequence[Cause],
                      residuals: ResidualModel) -> list[Fit]:
    """Return the sets of a leader with one of its delays, lags or held packets exchanged.

    They start from the parameters of the leader; sets that were fitted already are left out.  The
    time may be over, of which this takes some seconds more.
    """
    method = residuals.method
    in_time = dataclasses.replace(
        residuals, deadline=time.monotonic() + method.search.other_delay_seconds)
    known = {cause_keys(one.hypothesis.members) for one in fits}
    members, exchanged = fitted_members(leader.hypothesis), list[Fit]()
    for k, member in enumerate(members):
        for other in other_delays(member):
            some = (*members[:k], other, *members[k + 1:])
            if (other.cause in causes and cause_keys(some) not in known
                    and not in_time.is_out_of_time):
                start = build_hypothesis(residuals.problem, some, leader.hypothesis)
                exchanged.append(fit(start, in_time, _STEPS, lender(leader, method.fitting)))
    return exchanged


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
