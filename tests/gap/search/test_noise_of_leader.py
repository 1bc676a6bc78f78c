"""A soft gear rings by the noise of its encoder: models are fed with the noise as it finds it."""

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem, make_residual_model

from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.transmission import JOINT_ELASTICITY
from clie_blocks.analysis.gap.search.noise_of_leader import with_noise_of_leader


@pytest.mark.parametrize("cause", [COULOMB, JOINT_ELASTICITY])
@pytest.mark.parametrize("excess", [0.1, 90.0])
def test_nothing_changes_without_a_gear_that_rings(cause, excess):
    problem = make_problem()
    residuals, nominal = make_residual_model(problem), make_fit(problem, excess=100.0)
    leader = make_fit(problem, make_member(cause, problem), excess=excess)
    same, fits = with_noise_of_leader(residuals, nominal, [leader])
    assert same is residuals and fits == [leader]


@pytest.mark.slow
def test_the_gear_of_a_light_wrist_is_as_soft_as_it_is(tmp_path):
    """Seven axes in MuJoCo: with the noise of the nominal model it was 28 Hz, and 7 were left."""
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    from clie_blocks import gap
    from clie_blocks.analysis.blind.population.arms_in_space import ARMS_IN_SPACE
    from clie_blocks.analysis.blind.population.files import write_trial
    from clie_blocks.analysis.blind.population.maker import make_trial

    trial = make_trial(ARMS_IN_SPACE, 55811, 76)
    write_trial(trial, tmp_path)
    found = gap.diagnose(gap.read(tmp_path), effects=["joint_elasticity"])
    links, wrist = trial.robot.links, 6
    inertia = (1.0 + trial.truth["heavier"][wrist]) * (
        links.inertia[wrist][2] + links.mass[wrist] * np.sum(links.com[wrist][:2] ** 2))
    rate = np.sqrt(trial.truth["twist_stiffness"][wrist] / inertia)
    frequency = found.model.hypothesis.values["joint_elasticity.frequency"][wrist]
    assert found.ranking[0].names == ("joint_elasticity",)
    assert found.ranking[0].excess < 0.2
    assert 2.0 * np.pi * frequency == pytest.approx(rate, rel=0.1)
