"""Arms whose links push each other: slopes of a fit, and a refit from numbers that are far off."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.causes import load  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis  # noqa: E402
from clie_blocks.analysis.gap.fitting.jacobian import jacobian  # noqa: E402
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import (
    fit,  # noqa: E402
)
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402

ROWS = 6000


@pytest.fixture(scope="module")
def arm(engine_arm):
    """Problem of a five-joint arm with gears of 1.6 to 130, whose file has one wrong rotor."""
    rng = np.random.default_rng(20)
    body = dataclasses.replace(draw_robot(rng, "arm", True), period=1e-3)
    truth = draw_truth(rng, body)
    robot, records = engine_arm(rng, body, truth, ROWS)
    wrong = np.where(np.arange(body.n) == 1, 1.5, 1.0)
    motor = dataclasses.replace(robot.motor, inertia=wrong * robot.motor.inertia)
    return Problem.from_logs(dataclasses.replace(robot, motor=motor), records, [])


@pytest.fixture
def quick(monkeypatch):
    """Slopes that take what one joint does to another for nothing."""
    monkeypatch.setattr(Hypothesis, "coupled", False)


def slopes(at, bench):
    """Columns of a hypothesis that no bench has seen."""
    return jacobian(at.with_values(at.values), bench).columns[:-len(at.free_parameters)]


def far(columns, at, bench):
    """Relative distance of the column of the second rotor from a central difference."""
    entry = at.free_parameters[1]
    step = 0.02 * entry.size
    sides = [jacobian(at.with_values(at.moved([(entry, at.get(entry) + sign * step)])),
                        bench).residual[:-len(at.free_parameters)] for sign in (-1, 1)]
    slope = (sides[1] - sides[0]) * entry.size / (2 * step)
    return np.linalg.norm(columns[:, 1] - slope) / np.linalg.norm(slope)


def test_slopes_hold_what_one_joint_does_to_another(arm):
    bench, base = fit_nominal(arm, METHOD)
    assert far(slopes(base.hypothesis, bench), base.hypothesis, bench) < 0.05


def test_without_it_a_slope_is_another(arm, quick):
    bench, base = fit_nominal(arm, METHOD)
    assert far(slopes(base.hypothesis, bench), base.hypothesis, bench) > 0.05


def test_the_refit_of_a_coupled_arm_is_not_stuck(arm, monkeypatch):
    bench, base = fit_nominal(arm, METHOD)
    monkeypatch.setattr(Hypothesis, "coupled", False)
    stuck = fit(build_hypothesis(bench.problem, ()), bench, 40)
    assert base.cost < 0.7 * stuck.cost
    assert base.excess < stuck.excess


def test_links_push_each_other_where_they_are_held_and_the_model_holds_it(arm):
    start = build_hypothesis(arm, ())
    assert start.coupled
    falling = dataclasses.replace(arm, law=dataclasses.replace(arm.law, kp=0 * arm.law.kp))
    assert not build_hypothesis(falling, ()).coupled
    loose = dataclasses.replace(arm.chain, has_coupling=False, has_gravity=False)
    apart = dataclasses.replace(arm, chain=loose)
    assert not build_hypothesis(apart, ()).coupled
    tip = Member(load.PAYLOAD, tuple(range(arm.n)), {"mass": np.ones(arm.n)},
                 {"mass": np.ones(arm.n)})
    assert build_hypothesis(apart, (tip,)).coupled
