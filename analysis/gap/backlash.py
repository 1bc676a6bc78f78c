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
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess, fit
from clie_blocks.analysis.gap.simulation.closed_loop import constants
from clie_blocks.analysis.gap.verdict.posterior import posterior

STIFFNESS, RATE = 0.3, 0.1  # of the gains: little of the rate, which carries most of the noise
TINY = 1e-3  # excess that is none
LEFT = 0.4  # excess per sample that the first look may leave before there is a second one
OF_LAW = "kp", "kd", "saturation"
SMALL = 0.03  # share of the excess that a right model may leave: impacts stay a little uncertain
WIDER = 0.8, 0.9, 1.0, 1.1, 1.25  # times the play that was found: where fits start anew
FLANKS = 250.0, 400.0, 600.0, 1000.0  # rad/s, as the stiffness of a closed gap
RESTARTS = 3  # the best of those starts
PART = 0.8  # the same, of play alone for the whole library to be asked


def explain_backlash(problem, table, causes, examined, calibration):
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
        ``examined(problem, causes, small, whole)``: bench, refitted nominal model and table of
        evidence; beside a hypothesis that leaves a small share no second cause is looked for.
    calibration : Calibration
        Numbers of the verdict.

    Returns
    -------
    tuple or None
        What `examined` returns in the softened loop; None where the first look stands.

    """
    if not _is_worthwhile(problem, table, causes, calibration):
        return None
    led = soften_loop(problem)
    _, _, alone = examined(led, (BACKLASH,), SMALL, whole=False)
    first = _leading_share(table, calibration)
    if _share(alone) > (PART if first > SMALL else first):
        return None
    bench, base, found = examined(led, causes, SMALL)
    found = _better_look(found, alone, bench)
    return (bench, base, found) if _has_backlash(found, calibration) else None


def _better_look(table, alone, bench):
    """Table of evidence with the best fit of play alone, which is sought from many starts."""
    mine = [row for row in (*table.rows, *alone.rows) if row.names == (BACKLASH.name,)]
    best = multistart(min(mine, key=lambda row: row.excess).fit, bench)
    row = dataclasses.replace(mine[0], excess=float(excess(best)), fit=best)
    return dataclasses.replace(table, rows=[row, *(other for other in table.rows
                                                   if other.names != row.names)])


def multistart(found, bench):
    """Return the best of a fit of play and of others that start around it.

    Each impact that comes or goes is a ridge in the misfit, and a fit stops before the next one.

    Parameters
    ----------
    found : Fit
        Of play alone.
    bench : Bench
        Whitening.

    """
    at = found.hypothesis
    starts = [at.with_values({**at.values, **{
        f"{BACKLASH.block}.{name}": value for name, value in (
            ("half_gap", wider * at.values[f"{BACKLASH.block}.half_gap"]),
            ("contact", contact + 0.0 * at.values[f"{BACKLASH.block}.contact"]))}})
        for wider in WIDER for contact in FLANKS]
    costs = sum((part**2).sum(axis=1) for j in range(len(at.problem.fit))
                for part in bench.residuals(at.means(j, [s.values for s in starts]), j))
    again = [fit(starts[i], bench) for i in np.argsort(costs)[:RESTARTS]]
    return min([found, *again], key=lambda one: one.total)


def to_stated_loop(ranking, model, problem):
    """Return a ranking and a fit of the second look as models in the stated loop of a problem."""
    stated = constants(problem)

    def moved(fit):
        if fit is None:
            return None
        at, learned = fit.hypothesis, len(fit.hypothesis.problem.fit)
        same = dataclasses.replace(problem, fit=problem.logs[:learned],
                                   held_out=problem.logs[learned:])
        values = {**at.values, **{key: stated[key] for key in OF_LAW}}
        return dataclasses.replace(fit, hypothesis=dataclasses.replace(at, problem=same,
                                                                       values=values))

    return [dataclasses.replace(s, fit=moved(s.fit)) for s in ranking], moved(model)


def _is_worthwhile(problem, table, causes, calibration):
    law, said = problem.law, posterior(table, calibration)[0].names
    feedback = law.variant != "loop" and np.all(law.kp > 0) and np.all(law.kd > 0)
    return (BACKLASH in causes and feedback and not problem.quiet
            and said != (BACKLASH.name,) and _share(table) * table.nothing > LEFT)


def _share(table):
    """Share of the excess that the best hypothesis leaves."""
    whole = max(table.nothing, TINY)
    return min([1.0, *(row.excess / whole for row in table.rows if not row.rival)])


def _leading_share(table, calibration):
    """Share that the most probable hypothesis leaves; all, where that is no cause."""
    left = {row.names: row.excess for row in table.rows if not row.rival}
    leading = posterior(table, calibration)[0].names
    return left.get(leading, table.nothing) / max(table.nothing, TINY)


def _has_backlash(table, calibration):
    """Whether the most probable hypothesis holds play."""
    return BACKLASH.name in posterior(table, calibration)[0].names


def soften_loop(problem):
    """Return the problem of models that follow the recorded commands.

    Parameters
    ----------
    problem : Problem
        With the law that ran.

    """
    law = dataclasses.replace(problem.law, kp=STIFFNESS * problem.law.kp,
                              kd=RATE * problem.law.kd, saturation=np.full(problem.n, np.inf))
    return dataclasses.replace(
        problem, law=law, quiet=True, fit=tuple(_with_recorded_commands(log, law) for log in problem.fit),
        held_out=tuple(_with_recorded_commands(log, law) for log in problem.held_out))


def _with_recorded_commands(log, law):
    """Log whose excitation is its command, with the feedback of the measured motion."""
    excitation = log.u + law.kp * log.q + law.kd * law.rate(log.q)
    return dataclasses.replace(log, q_d=np.zeros_like(log.q), pe=excitation,
                               dither=np.zeros_like(log.q))
