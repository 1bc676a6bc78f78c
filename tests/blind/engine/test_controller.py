"""The sampled controller against scipy and against the stated law."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from clie_blocks.analysis.blind.engine.controller import SampledController, filter_coefficients
from clie_blocks.analysis.blind.engine.parameters import healthy_parameters
from clie_blocks.analysis.blind.engine.robot import draw_robot


def _velocity_filter(robot):
    """G1 by the textbook formula of each discretisation."""
    high, low, period = *robot.corners, robot.period
    if robot.discretisation == "matched":
        denominator = np.poly(np.exp([-high * period, -low * period]))
        return np.array([1.0, -1.0]) * denominator.sum() / period, denominator
    method = {"backward": "backward_diff"}.get(robot.discretisation, robot.discretisation)
    numerator, denominator, _ = cont2discrete(
        ([high * low, 0], [1, high + low, high * low]), period, method)
    return numerator.ravel(), denominator


@pytest.mark.parametrize("discretisation", ["tustin", "zoh", "backward", "matched"])
def test_the_command_follows_from_the_measured_angle_by_the_stated_law(
        quiet_robot, discretisation):
    joint = quiet_robot("arm", seed=5)
    robot = dataclasses.replace(joint.robot, command_step=1e-3 * joint.robot.kp,
                                discretisation=discretisation)
    joint.robot = robot
    experiment = joint.experiment(0.8, torque=0.2 * robot.kp, angle=0.1)
    q, u = joint.run(experiment)
    numerator, denominator = _velocity_filter(robot)
    speed = lfilter(numerator, denominator, q - q[0], axis=0)
    stated = robot.kp * (experiment.q_d - q) - robot.kd * speed + experiment.pe
    assert np.max(np.abs(u - stated) / robot.command_step) < 0.501


@pytest.mark.parametrize("discretisation", ["tustin", "zoh", "backward", "matched"])
def test_every_velocity_filter_gives_the_slope_of_a_ramp(discretisation):
    b, a = filter_coefficients(np.array(150.0), np.array(300.0), 1e-3, discretisation)
    speed = lfilter(b, a, 0.7e-3 * np.arange(400))
    held = 5e-3 if discretisation == "zoh" else 1e-6  # a ramp in steps
    assert speed[-1] == pytest.approx(0.7, rel=held)


def test_a_controller_behind_answers_to_the_row_before():
    rng = np.random.default_rng(2)
    robot = draw_robot(rng, "axes")
    rows = [tuple(rng.standard_normal((3, 1, robot.n))) for _ in range(20)]
    prompt, delayed = ({**healthy_parameters(robot.n), "behind": np.full(robot.n, behind)}
                       for behind in (0.0, 1.0))
    commands = [[law(*row) for row in rows] for law in (_law(robot, prompt), _law(robot, delayed))]
    shifted = _law(robot, prompt)
    assert np.array_equal(commands[1], [shifted(*row) for row in [rows[0], *rows[:-1]]])
    assert not np.array_equal(*commands)


def _law(robot, parameters):
    return SampledController(robot, {key: value[None] for key, value in parameters.items()})
