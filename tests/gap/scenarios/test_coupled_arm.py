"""Arms with coupled links: the Jacobian of a fit, and a refit from parameters that are far off."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.causes import load  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import (  # noqa: E402
    Hypothesis,
    Member,
    build_hypothesis,
)
from clie_blocks.analysis.gap.fitting.jacobian import jacobian  # noqa: E402
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit  # noqa: E402
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


@pytest.fixture(scope="module")
def fitted(arm):
    """Residual model and refitted nominal model."""
    return fit_nominal(arm, METHOD)


@pytest.fixture
def uncoupled(monkeypatch):
    """Jacobians that neglect what one joint does to another."""
    monkeypatch.setattr(Hypothesis, "coupled", False)


def columns_of(hypothesis, residuals):
    """Columns of a hypothesis of which no Jacobian is cached, without the rows of the prior."""
    fresh = hypothesis.with_values(hypothesis.values)
    return jacobian(fresh, residuals).columns[:-len(hypothesis.free_parameters)]


def distance_from_difference(columns, hypothesis, residuals):
    """Relative distance of the column of the second rotor from a central difference."""
    parameter = hypothesis.free_parameters[1]
    step = 0.02 * parameter.size
    sides = []
    for sign in (-1, 1):
        change = [(parameter, hypothesis.get(parameter) + sign * step)]
        shifted = hypothesis.with_values(hypothesis.moved(change))
        sides.append(jacobian(shifted, residuals).residual[:-len(hypothesis.free_parameters)])
    slope = (sides[1] - sides[0]) * parameter.size / (2 * step)
    return np.linalg.norm(columns[:, 1] - slope) / np.linalg.norm(slope)


def test_the_jacobian_holds_what_one_joint_does_to_another(fitted):
    residuals, nominal = fitted
    columns = columns_of(nominal.hypothesis, residuals)
    assert distance_from_difference(columns, nominal.hypothesis, residuals) < 0.05


def test_a_jacobian_that_neglects_the_coupling_is_wrong(fitted, uncoupled):
    residuals, nominal = fitted
    columns = columns_of(nominal.hypothesis, residuals)
    assert distance_from_difference(columns, nominal.hypothesis, residuals) > 0.05


def test_the_refit_of_a_coupled_arm_does_not_stop_early(fitted, uncoupled):
    residuals, nominal = fitted
    stopped = fit(build_hypothesis(residuals.problem, ()), residuals, 40)
    assert nominal.cost < 0.7 * stopped.cost
    assert nominal.excess < stopped.excess


def test_links_are_coupled_where_a_loop_holds_them_and_the_model_couples_them(arm):
    assert build_hypothesis(arm, ()).coupled
    falling = dataclasses.replace(arm, law=dataclasses.replace(arm.law, kp=0 * arm.law.kp))
    assert not build_hypothesis(falling, ()).coupled
    decoupled = dataclasses.replace(arm, links=dataclasses.replace(
        arm.links, has_coupling=False, has_gravity=False))
    assert not build_hypothesis(decoupled, ()).coupled
    tip = Member(load.PAYLOAD, tuple(range(arm.n)), {"mass": np.ones(arm.n)},
                 {"mass": np.ones(arm.n)})
    assert build_hypothesis(decoupled, (tip,)).coupled
