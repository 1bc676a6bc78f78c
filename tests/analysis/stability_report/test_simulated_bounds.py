"""The loops stay inside what the bounds allow, by the factors that an independent study found."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.stability_report.simulated_bounds import (
    identification_errors,
    modelling_error,
    pd_trajectory,
    ultimate_radius,
)
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    disturbance_norm,
    theorem_2,
    ultimate_bound,
)
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints


@pytest.mark.parametrize("gains, reached", list(zip(paper.GAIN_PAIRS, (0.1468, 0.1564, 0.1375))))
def test_pd_loop_stays_inside_mu_0(gains, reached):
    joints = ControlledJoints.from_theta(paper.THETA, *gains)
    run = pd_trajectory(paper.paper_arm(), joints, paper.SET_POINT, paper_excitation)
    radius = ultimate_radius(*run)
    assert radius == pytest.approx(reached, abs=1e-4)
    assert radius < ultimate_bound(joints, disturbance_norm(joints, paper_excitation)[0]).mu_0


def test_identification_error_stays_inside_mu_1_once_the_estimates_have_converged():
    joints = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
    found, composite = identification_errors(
        paper.paper_arm(), joints, paper.SET_POINT, paper_excitation, gamma=20.0, alpha=1e-3)
    time = found["time"]
    eps = ultimate_radius(time, found["eps"], after=5.0)
    assert eps == pytest.approx(0.0029, abs=1e-4)
    early = ultimate_radius(time, found["e"], found["de"], after=5.0)
    late, other = (ultimate_radius(time, run["e"], run["de"], after=380.0)
                   for run in (found, composite))
    assert other == pytest.approx(late, rel=0.1) and other != late  # alpha is small
    mu_1 = theorem_2(joints, eps).mu_1
    assert late == pytest.approx(1.6e-4, rel=0.1)
    assert late < mu_1 < early  # V also holds the estimates: mu_1 is no bound on the way


def test_modelling_error_vanishes_for_decoupled_joints():
    joints = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
    rng = np.random.default_rng(0)
    q, dq, u = rng.normal(size=(3, 2, 5))
    plant = decoupled_joints(joints.a, joints.b, joints.d)
    np.testing.assert_allclose(modelling_error(plant, joints, q, dq, u), 0, atol=1e-12)
