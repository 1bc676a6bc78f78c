"""Where the fit of a candidate starts: beside a joint model that knows of the candidate.

The refitted nominal model has bent its inertia, damping and offset to make up for the cause that
it lacks.  A cause put beside numbers so bent acts twice, and a fit from there may never come back.
"""

from clie_blocks.analysis.gap.fit import linearised, shrunk, step
from clie_blocks.analysis.gap.hypothesis import hypothesis

JOINT_MODEL = ("inertia", "damping", "load")
STEPS = 2  # of the joint model alone


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
    at = hypothesis(bench.problem, candidate.members, base.hypothesis)
    for _ in range(STEPS):
        here = linearised(at, bench)
        if here.cost < base.cost:
            break
        answered = step(at, here, keys=JOINT_MODEL)
        if linearised(answered, bench).cost >= here.cost:
            break
        at = answered
    return shrunk(at, bench, base.cost)
