"""Noise of one joint's sensor moves the links, and with them the other joints."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.gap.residual.noise import sensor_noise_model  # noqa: E402
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses  # noqa: E402

ROWS = 10_000


@pytest.fixture(scope="module")
def healthy_arm(engine_arm):
    """Problem of a healthy arm of two with gears of 1.7 and 1.7, run by the engine."""
    rng = np.random.default_rng(126)
    body = draw_robot(rng, "arm", True)
    return Problem.from_logs(*engine_arm(rng, body, draw_truth(rng, body), ROWS), [])


def own_noise_alone(problem, k, responses):
    """Noise of joint k as if the sensors of the other joints had none."""
    return sensor_noise_model(problem, k, [response if j == k else 0.0 * response
                                           for j, response in enumerate(responses)])


def chi2_per_sample(problem, noise_model):
    """chi^2 per sample of each joint over all logs, of the refitted nominal model."""
    nominal = fit_nominal(problem, METHOD, noise_model)[1]
    return nominal.chi2.sum(axis=0) / nominal.samples.sum(axis=0)


def test_a_healthy_arm_leaves_noise_alone_where_the_noise_of_all_sensors_counts(healthy_arm):
    assert chi2_per_sample(healthy_arm, sensor_noise_model) == pytest.approx(1.0, abs=0.12)
    assert chi2_per_sample(healthy_arm, own_noise_alone).max() > 1.25


def test_the_noise_of_one_sensor_moves_the_other_joint_and_back(healthy_arm):
    inertia, damping = healthy_arm.nominal.inertia, healthy_arm.nominal.damping
    response = noise_responses(healthy_arm, 1, inertia, damping)[0]
    assert np.abs(response).max() > 1e-3
    assert abs(response.sum()) < 1e-2 * np.abs(response).sum()
