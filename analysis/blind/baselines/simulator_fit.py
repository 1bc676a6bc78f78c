"""Fit of damping, dry friction, armature and delay by simulation, as simulator tools do.

The numbers that a simulator's joint has are fitted together to the measured motion.  A number
counts as found where BIC wants it: the fit is repeated without friction, without delay, and
without both.
"""

from clie_blocks.analysis.blind.baselines.output_error import fitted
from clie_blocks.analysis.blind.baselines.weighing import answer
from clie_blocks.analysis.gap.causes import drive, friction

MENU = ((friction.COULOMB,), (drive.TIME_DELAY,), (friction.COULOMB, drive.TIME_DELAY))


def simulator_fit(problem):
    """Diagnose a robot by the numbers that its simulator's joints have."""
    return answer(problem, fitted(problem, MENU))
