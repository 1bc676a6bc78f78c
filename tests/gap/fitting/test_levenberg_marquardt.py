"""A step of a fit: where a parameter meets its bound, the others take the best step beside it."""

import numpy as np
import pytest
from factories import make_member, make_problem

from clie_blocks.analysis.gap.causes.cause import Cause, Number
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import Tangent
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import TINY, damped_step, predicted_gain
from clie_blocks.analysis.gap.method import METHOD

SLOPES = np.array([[1.0, 0.9], [0.9, 1.0], [0.3, -0.2]])
BOUND = 0.4


def step_to(goal, bounded=True):
    """Values after a step to what leaves no residual, and the gain that is predicted for it."""
    problem = make_problem()
    limit = BOUND if bounded else np.inf
    cause = Cause("leaning", (), (Number("first", "1", -limit, limit), Number("second", "1")),
                  lambda scene: [])
    start = build_hypothesis(problem, [make_member(cause, problem, first=0.0, second=0.0)])
    count = len(start.free_parameters)
    columns = np.zeros((len(SLOPES) + count, count))
    columns[:len(SLOPES), -2:] = SLOPES
    residual = np.concatenate([-SLOPES @ goal, np.zeros(count)])
    tangent = Tangent([residual[:len(SLOPES)]], residual, columns)
    after = damped_step(start, tangent, METHOD.fitting, TINY)
    return (np.concatenate([after.values["leaning.first"], after.values["leaning.second"]]),
            predicted_gain(start, tangent, METHOD.fitting), residual @ residual)


@pytest.mark.parametrize("goal", [(1.5, -1.2), (-1.5, 1.2)])
def test_a_parameter_at_its_bound_does_not_drag_the_others_along(goal):
    reached, gain, cost = step_to(np.array(goal))
    first = np.sign(goal[0]) * BOUND
    left = SLOPES @ goal - SLOPES[:, 0] * first
    second = SLOPES[:, 1] @ left / (SLOPES[:, 1] @ SLOPES[:, 1])
    np.testing.assert_allclose(reached, [first, second], rtol=1e-5)
    rest = left - SLOPES[:, 1] * second
    assert gain == pytest.approx(cost - rest @ rest, rel=1e-4)


def test_a_step_within_the_bounds_is_the_plain_one():
    goal = np.array([0.3, -1.2])
    for bounded in (True, False):
        reached, gain, cost = step_to(goal, bounded)
        np.testing.assert_allclose(reached, goal, rtol=1e-5)
        assert gain == pytest.approx(cost, rel=1e-4)
