"""An observer for machines that nothing holds: every model is led along the measured motion.

Without feedback an error of the model grows with time, and a fit over ten seconds sees little but
the first thing that it got wrong.  So each model gets the recorded command and a feedback that
holds it near the measured motion,

    u = u_log + kp (q_log - q) + kd F (q_log - q),    kp = w^2 inertia,  kd = 2 w inertia.

That is the law (11) with gains, the measured motion as reference and another excitation, so that
every stage runs on it as it is; how far the gap shrinks is told without the observer.
"""

import dataclasses

RATE = 20.0  # rad/s: three times as fast as an arm of 0.3 m swings, and far below the noise


def with_observer(problem):
    """Problem with an observer in every model, if the law holds no joint; else itself.

    Parameters
    ----------
    problem : Problem
        With the law that ran.

    """
    if not is_open_loop(problem.law):
        return problem
    inertia = problem.nominal.inertia
    law = dataclasses.replace(problem.law, kp=RATE**2 * inertia, kd=2.0 * RATE * inertia)
    return dataclasses.replace(problem, law=law, fit=_with_tracking(problem.fit, law),
                               held_out=_with_tracking(problem.held_out, law))


def without_observer(at, asked):
    """Hypothesis without the observer, to be judged by the commands alone.

    A hypothesis that learned from all logs keeps the observer, in which it is refitted where
    blocks are left out.

    Parameters
    ----------
    at : Hypothesis
        Fitted with the observer, or in the stated loop.
    asked : Problem
        As it was stated.

    """
    if not is_open_loop(asked.law) or not at.problem.held_out:
        return at
    alone = dataclasses.replace(at.problem, law=asked.law, fit=asked.fit, held_out=asked.held_out)
    values = {**at.values, "kp": asked.law.kp, "kd": asked.law.kd}
    return dataclasses.replace(at, problem=alone, values=values)


def is_open_loop(law):
    """Whether a law holds no joint."""
    return law.variant != "loop" and not (law.kp.any() or law.kd.any())


def _with_tracking(logs, law):
    return tuple(dataclasses.replace(log, q_d=log.q, pe=log.u + law.kd * law.rate(log.q))
                 for log in logs)
