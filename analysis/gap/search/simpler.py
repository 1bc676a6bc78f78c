"""Sets that hold a cause which has shrunk to a simpler one, as sets of the simpler one.

Friction that grows with load, without any slope, is Coulomb friction.  A set grows from whichever
of them came first, and from other starts the simpler one may have ended in a false minimum; but it
explains as much, with fewer parameters.
"""

from collections.abc import Iterator, Sequence

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.fitting.nesting import shrunk_name
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import Candidate, cause_keys, fitted_members


def simpler_candidates(likely: Sequence[Fit], fits: Sequence[Fit], causes: Sequence[Cause],
                       residuals: ResidualModel) -> list[Candidate]:
    """Return the simpler sets of some fits that no fit does as well as they do.

    Parameters
    ----------
    likely : sequence of Fit
        Those that may hold a cause which has shrunk.
    fits : sequence of Fit
        All that were fitted.
    causes : sequence of Cause
        Those that are searched for.
    residuals : ResidualModel
        Of the logs.

    """
    least = residuals.method.search.false_minimum_gain
    best = {cause_keys(fit.hypothesis.members): fit.cost
            for fit in sorted(fits, key=lambda one: -one.cost)}
    candidates = [Candidate(members, 0.0, fit) for fit in likely
                  for members in _simpler(fit, causes, residuals)]
    return [one for one in candidates if one.extends is not None
            and best.get(cause_keys(one.members), float("inf")) > one.extends.cost + least]


def _simpler(fit: Fit, causes: Sequence[Cause], residuals: ResidualModel,
             ) -> Iterator[tuple[Member, ...]]:
    """The causes of a fit with those that have shrunk as what they are; nothing if none has."""
    members = tuple(_as_simpler(fit, member, causes, residuals)
                    for member in fitted_members(fit.hypothesis))
    own = cause_keys(fit.hypothesis.members)
    if cause_keys(members) != own and len({one.cause.name for one in members}) == len(members):
        yield members


def _as_simpler(fit: Fit, member: Member, causes: Sequence[Cause], residuals: ResidualModel,
                ) -> Member:
    """A member as the simpler cause that it is; itself where no such cause is searched for."""
    name = shrunk_name(fit, member, residuals.method)
    for cause in causes:
        keys = [number.name for number in cause.numbers]
        if cause.name == name != member.cause.name and {*keys} <= {*member.values}:
            return Member(cause, member.joints, {key: member.values[key] for key in keys},
                          {key: member.sizes[key] for key in keys})
    return member
