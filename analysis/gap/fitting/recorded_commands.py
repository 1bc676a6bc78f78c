"""Models that get the commands of the logs, and a feedback of their own along the measured motion.

A model in the stated loop sees only the reference, and where the gap is large its motion leaves
the measured one.  Here every model gets the command that was recorded, noise included, and another
feedback holds it near the measured motion,

    u = u_log + kp' (q_log - q) + kd' F (q_log - q).

With kp' = kp and kd' = kd that is the stated loop again: u_log contains the feedback of q_log, and
the two cancel.  It is the law (11) with other gains and another excitation, so every stage runs on
it as it is, and the whitened residual of a linear model is the same for all gains.  Recorded
commands hide a fault of the controller.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem


def has_feedback(problem: Problem) -> bool:
    """Whether the law of a problem feeds position and velocity of every joint back."""
    law = problem.law
    return bool(isinstance(law, StatedLaw) and np.all(law.kp > 0) and np.all(law.kd > 0))


def with_recorded_commands(problem: Problem, stiffness: float, damping: float) -> Problem:
    """Problem of models that get the recorded commands and follow the measured motion.

    Parameters
    ----------
    problem : Problem
        In the stated loop.
    stiffness, damping : float
        Feedback of position and velocity, over that of the law.

    """
    stated = problem.stated_law.pd
    law = dataclasses.replace(stated, kp=stiffness * stated.kp, kd=damping * stated.kd,
                              saturation=np.full(problem.n, np.inf))
    following = problem.with_logs(lambda log: _with_recorded_commands(log, law))
    return dataclasses.replace(following, law=law, quiet=True)


def _with_recorded_commands(log: Log, law: StatedLaw) -> Log:
    """Log whose excitation is its command, with the feedback of the measured motion."""
    excitation = log.u + law.kp * log.law_q + law.kd * law.rate(log.law_q)
    return dataclasses.replace(log, q_d=np.zeros_like(log.q), pe=excitation,
                               dither=np.zeros_like(log.q))
