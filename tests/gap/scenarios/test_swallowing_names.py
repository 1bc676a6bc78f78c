"""Names that swallow others need evidence of their own mark, on either side of a gear."""

import pytest
from one_joint import RATIO, Physics, logs, robot

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.posterior import marginals

pytestmark = pytest.mark.slow

WEIGHT = 6.0  # N m, which the joint's own simulator holds as well
BESIDE = Physics(weight=WEIGHT)


def diagnosis_of(physics, ratio, simulated=None):
    """Diagnosis of the joint with torques behind a gear ratio, alone or against a simulator."""
    side = ratio or 1.0
    problem = Problem.from_logs(robot(ratio), logs(physics, side))
    if simulated is not None:
        problem = problem.beside(logs(simulated, side, simulated=True))
    return diagnose(problem)


def likely(diagnosis):
    """Names that the verdict rests on, with their probabilities."""
    return {name: share for name, share in marginals(diagnosis.ranking).items() if share > 0.05}


@pytest.mark.parametrize("physics, simulated, right", [
    (BESIDE, BESIDE, "none"),
    (Physics(weight=WEIGHT, dry=2.0), BESIDE, "coulomb"),
    (Physics(dry=2.0), None, "coulomb"),
    (Physics(weight=3.0), None, "gravity"),
    (Physics(ripple=0.2), None, "torque_ripple"),
    (Physics(step=1.0), None, "step_fault")],
    ids=["sound", "friction", "friction alone", "weight", "ripple", "fault"])
def test_the_answer_does_not_depend_on_the_side_of_the_gear(physics, simulated, right):
    at_motor, at_joint = (diagnosis_of(physics, ratio, simulated) for ratio in (RATIO, None))
    assert at_joint.verdict == at_motor.verdict != "unexplained"
    assert next(iter(likely(at_joint))) == right
    assert likely(at_joint) == pytest.approx(likely(at_motor), abs=0.05)
