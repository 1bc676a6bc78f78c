"""Simulations of several logs and sets of values, spread over threads."""

import numpy as np
import pytest

from clie_blocks import processors as module
from clie_blocks.analysis.gap.fitting.hypothesis import costs, residuals_of_sets
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem


@pytest.mark.parametrize("sets", [1, 9, 40])
def test_logs_and_groups_of_runs_give_the_same_in_one_thread_and_in_several(
        case, monkeypatch, sets):
    robot = case("coulomb")
    residuals, nominal = fit_nominal(Problem.from_logs(robot.robot, robot.records), METHOD)
    hypothesis = nominal.hypothesis
    assert hypothesis.simulator.threads is None
    damping = hypothesis.values["damping"]
    values = [{**hypothesis.values, "damping": damping * factor}
              for factor in np.linspace(0.5, 2.0, sets)]
    found = []
    for threads in (1, 3):
        monkeypatch.setattr(module, "processors", lambda threads=threads: threads)
        found.append((residuals_of_sets(hypothesis, values, residuals),
                      costs([hypothesis.with_values(one) for one in values], residuals)))
    (alone, cost_alone), (spread, cost_spread) = found
    assert len(alone) == len(residuals.problem.fit)
    for of_log, same in zip(alone, spread):
        for part, other in zip(of_log, same):
            assert part.shape[0] == sets
            np.testing.assert_array_equal(part, other)
    np.testing.assert_array_equal(cost_alone, cost_spread)
