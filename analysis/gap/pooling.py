"""When the log that judges holds most of the gap, the search reads it too.

A cause can hide in the logs to learn from: a dead zone is an offset until the torque changes
sign, a limit is nothing until the torque reaches it.  Numbers found there say nothing of a log in
which the cause acts, and every hypothesis fails in it, the right one too.

What a model so learned predicts is judged on blocks left out of its fit, or on whole logs where
they are short.
"""

import dataclasses

RATIO = 3.0  # times the misfit of all others, from which on a log is one to learn from
LEAST = 1.0  # excess per sample of a log and joint that says something


def pooled(problem, base):
    """Return the problem with all logs to learn from, if the refitted nominal model asks for it.

    Parameters
    ----------
    problem : Problem
        With logs that judge.
    base : Fit
        The nominal model, refitted to the other logs.

    """
    fit = len(problem.fit)
    beyond = base.chi2 / base.samples - 1.0
    learned, judged = beyond[:fit].max(axis=0), beyond[fit:].max(axis=0, initial=0.0)
    if (judged > RATIO * learned.clip(min=LEAST)).any():
        return dataclasses.replace(problem, fit=problem.logs, held_out=())
    return problem
