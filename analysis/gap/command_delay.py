"""A command that is worked out in one period and sent in the next, of which the file says nothing.

The log then shows in every row what the law made of the row before.  Put back into the row in
which it was worked out, the command is that of the stated law, and acts one period late: a matter
of the controller's description, and no lag of the drive.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.hypothesis import Member
from clie_blocks.analysis.gap.replayed import left_by

SURE = 0.02  # of the period: how well its length is known
WORDS = ("every command follows from the row before it: the controller sends it one period after "
         "it has measured; the file is wrong, and the model has this delay from here on")


def late_error(problem, law):
    """RMS of the logged command less that of the law in the row before it, shape (n,)."""
    squares = [np.mean(left_by(law, log, late=1) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def in_time(problem):
    """Problem whose commands stand where they were worked out, with the delay that this leaves.

    Parameters
    ----------
    problem : Problem
        Logs with late commands.

    """
    def logs(found):
        return tuple(dataclasses.replace(log, u=np.concatenate([log.u[1:], log.u[-1:]]))
                     for log in found)

    period = np.full(problem.n, problem.period)
    delay = Member(TIME_DELAY, tuple(range(problem.n)), {"time": period},
                   {"time": SURE * period})
    return dataclasses.replace(problem, fit=logs(problem.fit), held_out=logs(problem.held_out),
                               inside=(*problem.inside, delay))
