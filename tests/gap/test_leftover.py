"""The free torque: it finds what depends on the pose, and nothing where nothing is."""

import dataclasses

import pytest

from clie_blocks.analysis.gap import own_robots
from clie_blocks.analysis.gap.baseline import baseline
from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.leftover import structured
from clie_blocks.analysis.gap.problem import problem


def fitted(made):
    bench, base = baseline(problem(made.robot, made.records))
    return base, bench


def test_a_healthy_robot_leaves_nothing_to_a_free_torque(case):
    base, bench = fitted(case("none"))
    assert excess(base) == pytest.approx(structured(base, bench), abs=0.02)


def test_a_stop_on_one_side_is_explained_on_logs_that_the_torque_was_not_fitted_to(monkeypatch):
    monkeypatch.setattr(own_robots, "UNKNOWN", ("soft_stop",))
    made, = own_robots.cases(1, 4, ["coulomb"], ["unknown"], duration=8.0)
    base, bench = fitted(made)
    assert excess(base) > 10.0
    assert structured(base, bench) < 0.2 * excess(base)
    only = dataclasses.replace(bench.problem, fit=bench.problem.fit[:1], held_out=())
    bench, base = baseline(only)
    assert structured(base, bench) <= excess(base)
