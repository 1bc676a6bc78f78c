"""Fit of damping, dry friction, armature and delay by simulation, as simulator tools do.

The numbers that a simulator's joint has are fitted together to the measured motion.  A number
counts as found where BIC wants it: the fit is repeated without friction, without delay, and
without both.
"""

from clie_blocks.analysis.blind.baselines.output_error import fitted
from clie_blocks.analysis.blind.baselines.weighing import answer
from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.problem import problem as state_problem

MENU = ((friction.COULOMB,), (drive.TIME_DELAY,), (friction.COULOMB, drive.TIME_DELAY))


def simulator_fit(robot, records):
    """Diagnose a robot by the numbers that its simulator's joints have.

    Parameters
    ----------
    robot : Robot
        What is known.
    records : list of Record
        Its logs; the last one only judges.

    """
    problem = state_problem(robot, records)
    return answer(problem, fitted(problem, MENU))
