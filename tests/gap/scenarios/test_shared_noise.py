"""Noise of one joint's sensor shakes the links, and with them the other joints."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import problem  # noqa: E402
from clie_blocks.analysis.gap.residual import sensitivity  # noqa: E402
from clie_blocks.analysis.gap.residual.sensitivity import noise_responses  # noqa: E402

ROWS = 10_000


@pytest.fixture(scope="module")
def healthy_arm(engine_arm):
    """Problem of a sound arm of two with gears of 1.7 and 1.7, run by the engine."""
    rng = np.random.default_rng(126)
    body = draw_robot(rng, "arm", True)
    return problem(*engine_arm(rng, body, draw_truth(rng, body), ROWS), [])


def left(asked):
    """chi^2 per sample of each joint over all logs, beside the refitted nominal model."""
    base = fit_nominal(asked, METHOD)[1]
    return base.chi2.sum(axis=0) / base.samples.sum(axis=0)


def test_a_sound_arm_leaves_noise_alone_once_the_shaking_is_counted(healthy_arm, monkeypatch):
    assert left(healthy_arm) == pytest.approx(1.0, abs=0.12)
    monkeypatch.setattr(sensitivity, "_shared_mass", lambda problem, k: np.zeros(problem.n))
    assert left(healthy_arm).max() > 1.25


def test_own_noise_is_what_one_joint_alone_makes_of_it(healthy):
    inertia, damping = healthy.nominal.inertia, healthy.nominal.damping
    found = noise_responses(healthy, 0, inertia, damping)[0]
    b, a = healthy.law.sensor_sensitivity(0, inertia[0], damping[0])
    rebuilt = np.convolve(found, a)[:len(found)]  # a times the response is b, and then nothing
    assert rebuilt[:len(b)] == pytest.approx(b, abs=1e-9)
    assert np.abs(rebuilt[len(b):]).max() < 1e-9


def test_the_push_goes_with_the_mass_that_is_shared(healthy_arm):
    inertia, damping = healthy_arm.nominal.inertia, healthy_arm.nominal.damping
    masses = sensitivity._shared_mass(healthy_arm, 1)
    assert masses[0] > 0.0
    pushed = noise_responses(healthy_arm, 1, inertia, damping)[0]
    assert np.abs(pushed).max() > 1e-3
    assert abs(pushed.sum()) < 1e-2 * np.abs(pushed).sum()  # a push that goes and comes back
