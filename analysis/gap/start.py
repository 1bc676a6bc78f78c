"""Where the fit of a candidate starts: beside numbers that know of the candidate.

The refitted nominal model has bent its inertia, damping and offset to make up for the cause that
it lacks.  A cause put beside numbers so bent acts twice, and a fit from there may never come back.
The same holds for a second cause beside the fit of a first one.
"""

from clie_blocks.analysis.gap.fit import shrunk
from clie_blocks.analysis.gap.hypothesis import hypothesis
from clie_blocks.analysis.gap.slopes import linearised
from clie_blocks.analysis.gap.step import step

STEPS = 2  # of the numbers that were there before


def started(candidate, bench, base):
    """Return the hypothesis of a candidate that a fit starts from.

    Parameters
    ----------
    candidate : Candidate
        Causes with numbers from a linear regression.
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.

    """
    before = candidate.after or base
    at = hypothesis(bench.problem, candidate.members, before.hypothesis)
    there = {entry.key for entry in before.hypothesis.open}
    known = {member.name for member in before.hypothesis.members}
    new = [member for member in candidate.members if member.name not in known]
    extends = len(known) + len(new) == len(candidate.members)
    reference = (before if extends else base).cost
    for _ in range(STEPS):
        here = linearised(at, bench)
        if here.cost < reference:
            break
        answered = step(at, here, keys=there)
        if linearised(answered, bench).cost >= here.cost:
            break
        at = answered
    return shrunk(at, bench, reference, new)
