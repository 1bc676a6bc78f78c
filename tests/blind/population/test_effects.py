"""Each hidden effect changes its joint alone, and vanishes with its size."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.parameters import NEUTRAL
from clie_blocks.analysis.blind.engine.robot import (
    draw_robot,
    draw_truth,
)
from clie_blocks.analysis.blind.population.effect_site import Site
from clie_blocks.analysis.blind.population.effects import EFFECTS, draw_effect
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.scoring.decisions import FAMILY


def test_at_least_eight_effects_are_outside_the_vocabulary():
    assert len(OUTSIDERS) >= 8 and not set(OUTSIDERS) & set(FAMILY)
    assert set(EFFECTS) == set(FAMILY)


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDERS])
def test_an_effect_changes_parameters_only_at_its_joint_and_vanishes_with_its_size(name):
    rng = np.random.default_rng(8)
    robot = draw_robot(rng, "arm", name == "load_dependent_friction", name != "coupling")
    truth = draw_truth(rng, robot)
    runs = [(robot.pose + 0.1 * np.sin(np.arange(50.0))[:, None], np.ones((50, robot.n)))]
    hidden = draw_effect(rng, name, Site(robot, truth, runs, 1))
    strong, weak = hidden.apply(truth, 3.0), hidden.apply(truth, 1e-9)
    changed = {key for key in NEUTRAL if not np.array_equal(strong[key], truth[key])}
    assert changed
    if hidden.joints:
        assert all(strong[key][0] == truth[key][0] for key in changed)
    grows = [key for key in changed if not np.array_equal(strong[key], weak[key])]
    assert grows
