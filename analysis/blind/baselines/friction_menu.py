"""Closed-loop least squares over a fixed menu of friction models, as servo identification does.

The menu runs from plain Coulomb friction to Stribeck friction that grows with the load, as the
models M1 to M6 of the BAM servo identification do; BIC chooses.
"""

from clie_blocks.analysis.blind.baselines.output_error import fitted
from clie_blocks.analysis.blind.baselines.weighing import answer
from clie_blocks.analysis.gap.causes import friction

MENU = ((friction.COULOMB,), (friction.STRIBECK,), (friction.ASYMMETRIC_COULOMB,),
        (friction.LOAD_DEPENDENT_FRICTION[0],), (friction.QUADRATIC_DRAG,))


def friction_menu(problem):
    """Diagnose a robot by fitting each friction model of the menu in closed loop."""
    return answer(problem, fitted(problem, MENU))
