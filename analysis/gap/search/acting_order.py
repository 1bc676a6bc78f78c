"""The order in which the causes of a drive act on a command, and those of a sensor on a position.

A limit behind a lag is not one before it, and a ripple of the current that a lag follows is
smoothed.  A further cause is added behind the others, so the order in which they were found is
not that of the machine; of a strong one a wrong order leaves more than weak causes do altogether.
Of two causes that only shift a signal in time either may come first.
"""

from collections.abc import Iterator, Sequence

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import fitted_members
from clie_blocks.effects import LIBRARY

_IN_SERIES = ("drive", "sensor")  # ports whose pieces read what those before them made


def in_best_order(leader: Fit, nominal: Fit, residuals: ResidualModel) -> Fit:
    """Return a fit with its causes in the order that explains most; itself where none does better.

    Neighbours in a chain are exchanged as long as that pays.
    """
    method = residuals.method
    like, best, is_better = lender(nominal, method.fitting), leader, True
    while is_better and not residuals.is_out_of_time:
        is_better = False
        for members in _exchanged(fitted_members(best.hypothesis)):
            start = build_hypothesis(residuals.problem, members, best.hypothesis)
            other = fit(start, residuals, method.search.finalist_steps, like)
            if other.cost < best.cost - method.search.false_minimum_gain:
                best, is_better = other, True
                break
    return best


def _exchanged(members: Sequence[Member]) -> Iterator[tuple[Member, ...]]:
    """Members with two exchanged that follow each other in a chain of the same joint."""
    for port in _IN_SERIES:
        chain = [k for k, member in enumerate(members)
                 if any(piece.port == port for piece in member.cause.pieces)]
        for first, second in zip(chain, chain[1:]):
            if (set(members[first].joints) & set(members[second].joints)
                    and not (_only_shifts(members[first]) and _only_shifts(members[second]))):
                changed = list(members)
                changed[first], changed[second] = members[second], members[first]
                yield tuple(changed)


def _only_shifts(member: Member) -> bool:
    """Whether a cause makes a signal late, and does nothing else to it."""
    name = member.cause.name  # a number of the robot file is no effect
    return name in LIBRARY and LIBRARY[name].family == "timing"
