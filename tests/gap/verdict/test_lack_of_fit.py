"""The free torque: it finds what depends on the pose, and nothing where nothing is."""

import dataclasses

import pytest

from clie_blocks.analysis.gap.calibration import robots
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.lack_of_fit import excess_with_free_torque


def fitted(made):
    bench, base = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    return base, bench


def test_a_healthy_robot_leaves_nothing_to_a_free_torque(case):
    base, bench = fitted(case("none"))
    assert base.excess == pytest.approx(excess_with_free_torque(base, bench), abs=0.02)


@pytest.mark.slow
def test_a_stop_on_one_side_is_explained_on_logs_that_the_torque_was_not_fitted_to(monkeypatch):
    monkeypatch.setattr(robots, "UNKNOWN", ("soft_stop",))
    made, = robots.draw_cases(1, 4, ["coulomb"], ["unknown"], duration=8.0)
    base, bench = fitted(made)
    assert base.excess > 10.0
    assert excess_with_free_torque(base, bench) < 0.2 * base.excess
    only = dataclasses.replace(bench.problem, fit=bench.problem.fit[:1], held_out=())
    bench, base = fit_nominal(only, METHOD)
    assert excess_with_free_torque(base, bench) <= base.excess
