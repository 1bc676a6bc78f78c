"""A second look, in a loop that follows the recorded commands, where play may be at work.

A model that runs freely in closed loop hears of the robot only what was asked of it.  Where play
lets a link rattle, or a loop hunts, the noise of the sensor decides the next impact, and after
some of them model and robot have parted, however true the model is.  Here every model gets the
command that was recorded, noise and all, and a fraction of the feedback holds it near the
measured motion,

    u = u_log + kp' (q_log - q) + kd' F (q_log - q),    kp' < kp,  kd' < kd.

That is the law (11) again, with softer gains and another excitation, so every stage runs on it as
it is, and what a linear model leaves is the same in both loops once it is whitened.  Recorded
commands hide a fault of the controller: the second look is believed only where it finds play.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.closed_loop import constants
from clie_blocks.analysis.gap.verdict import weighed

STIFFNESS, RATE = 0.3, 0.1  # of the gains: little of the rate, which carries most of the noise
LEFT = 0.4  # excess per sample that the first look may leave before there is a second one
OF_LAW = "kp", "kd", "saturation"
SMALL = 0.03  # share of the excess that a right model may leave: impacts stay a little uncertain
PART = 0.8  # share of the excess that play alone may leave for the whole library to be asked


def second_look(problem, table, causes, examined, calibration):
    """Examine a problem again where something is left that may be play.

    Parameters
    ----------
    problem : Problem
        With the law that ran.
    table : Table
        Evidence of the first look.
    causes : sequence of Cause
        What to look for.
    examined : callable
        ``examined(problem, causes, small)``: bench, refitted nominal model and table of evidence;
        beside a hypothesis that leaves a small share no second cause is looked for.
    calibration : Calibration
        Numbers of the verdict.

    Returns
    -------
    tuple or None
        What `examined` returns in the softened loop; None where the first look stands.

    """
    if not _worthwhile(problem, table, causes, calibration):
        return None
    led = softened(problem)
    _, _, alone = examined(led, (BACKLASH,), SMALL)
    if _least(alone) > PART * alone.nothing:
        return None
    found = examined(led, causes, SMALL)
    return found if _plays(found[2], calibration) else None


def in_the_loop(ranking, model, problem):
    """Return a ranking and a fit of the second look as models in the stated loop of a problem."""
    stated = constants(problem)

    def moved(fit):
        if fit is None:
            return None
        values = {**fit.hypothesis.values, **{key: stated[key] for key in OF_LAW}}
        return dataclasses.replace(fit, hypothesis=dataclasses.replace(
            fit.hypothesis, problem=problem, values=values))

    return [dataclasses.replace(s, fit=moved(s.fit)) for s in ranking], moved(model)


def _worthwhile(problem, table, causes, calibration):
    asked = BACKLASH in causes and not problem.quiet and problem.law.variant != "loop"
    said = weighed(table, calibration)[0].names
    return asked and said != (BACKLASH.name,) and min(_least(table), table.nothing) > LEFT


def _least(table):
    return min((row.excess for row in table.rows), default=table.nothing)


def _plays(table, calibration):
    """Whether the most probable hypothesis holds play."""
    return BACKLASH.name in weighed(table, calibration)[0].names


def softened(problem):
    """Return the problem of models that follow the recorded commands.

    Parameters
    ----------
    problem : Problem
        With the law that ran.

    """
    law = dataclasses.replace(problem.law, kp=STIFFNESS * problem.law.kp,
                              kd=RATE * problem.law.kd, saturation=np.full(problem.n, np.inf))
    return dataclasses.replace(
        problem, law=law, quiet=True, fit=tuple(_led(log, law) for log in problem.fit),
        held_out=tuple(_led(log, law) for log in problem.held_out))


def _led(log, law):
    """Log whose excitation is its command, with the feedback of the measured motion."""
    excitation = log.u + law.kp * log.q + law.kd * law.rate(log.q)
    return dataclasses.replace(log, q_d=np.zeros_like(log.q), pe=excitation,
                               dither=np.zeros_like(log.q))
