"""An observer for machines that nothing holds: every model is led along the measured motion.

Without feedback an error of the model grows with time, and a fit over ten seconds sees little but
the first thing that it got wrong.  So each model gets the recorded command and a feedback that
holds it near the measured motion,

    u = u_log + kp (q_log - q) + kd F (q_log - q),    kp = w^2 inertia,  kd = 2 w inertia.

That is the law (11) with gains, the measured motion as reference and another excitation, so that
every stage runs on it as it is: without it, how far the gap shrinks would say little of a cause.
"""

import dataclasses

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.robot_loop.sampled_law import PARAMETERS


def with_observer(problem: Problem, method: Method) -> Problem:
    """Problem with an observer in every model, if the law holds no joint; else itself."""
    if problem.law.holds_joints or not isinstance(problem.law, StatedLaw):
        return problem
    rate, inertia = method.fitting.observer_rate, problem.nominal.inertia
    law = dataclasses.replace(problem.law, kp=rate**2 * inertia, kd=2.0 * rate * inertia)
    return dataclasses.replace(problem.with_logs(lambda log: _with_tracking(log, law)), law=law)


def without_observer(model: Hypothesis, problem: Problem) -> Hypothesis:
    """Hypothesis without the observer, driven by the commands of the problem alone.

    A hypothesis that was fitted to all logs keeps the observer, in which it is refitted where
    blocks are left out.
    """
    if problem.law.holds_joints or not model.problem.held_out:
        return model
    alone = dataclasses.replace(model.problem, law=problem.law, fit=problem.fit,
                                held_out=problem.held_out)
    values = {key: value for key, value in model.values.items() if key != PARAMETERS}
    values |= {"kp": problem.law.kp, "kd": problem.law.kd}
    return dataclasses.replace(model, problem=alone, values=values)


def _with_tracking(log: Log, law: StatedLaw) -> Log:
    """Log whose reference is its motion, and whose excitation is its command."""
    return dataclasses.replace(log, q_d=log.q, pe=log.u + law.kd * law.rate(log.q))
