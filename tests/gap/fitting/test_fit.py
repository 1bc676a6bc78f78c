"""A fitted hypothesis: whether its model has diverged."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.fitting.fit import FAR
from tests.gap.factories import Missing, make_fit, make_problem


@pytest.mark.parametrize(("largest", "diverged"), [(0.5, False), (0.49 * FAR, False),
                                                   (0.51 * FAR, True), (100.0, True)])
def test_a_model_that_leaves_the_motion_far_behind_has_diverged(largest, diverged):
    problem = make_problem()  # of a ramp of 0.5 rad
    fitted = make_fit(problem)
    missed = np.zeros_like(problem.logs[0].q)
    missed[-1] = largest
    hypothesis = Missing(problem, (), fitted.hypothesis.values, missed)
    assert dataclasses.replace(fitted, hypothesis=hypothesis).has_diverged is diverged
