"""Each hidden effect changes its joint alone, and vanishes with its size."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.parameters import NEUTRAL
from clie_blocks.analysis.blind.engine.robot import (
    draw_robot,
    draw_truth,
)
from clie_blocks.analysis.blind.population.catalogue import CATALOGUE, PARAMETERS
from clie_blocks.analysis.blind.population.effect_site import Site
from clie_blocks.analysis.blind.population.effects import STANDARD_NAMES
from clie_blocks.analysis.blind.scoring.decisions import FAMILY
from clie_blocks.effects import LIBRARY

NAMES = [*CATALOGUE.effects, *CATALOGUE.outsiders]


def test_every_name_of_the_catalogue_is_made_and_at_least_eight_outsiders():
    assert {*CATALOGUE.effects, *PARAMETERS} == set(LIBRARY)
    assert len(CATALOGUE.outsiders) >= 8 and not set(CATALOGUE.outsiders) & set(LIBRARY)
    assert set(CATALOGUE.effects) == set(FAMILY)


def test_the_standard_study_keeps_its_names_and_their_order():
    assert len(STANDARD_NAMES.effects) == 24 and len(STANDARD_NAMES.outsiders) == 12
    assert set(STANDARD_NAMES.effects) < set(CATALOGUE.effects)


@pytest.mark.parametrize("name", [*NAMES, *STANDARD_NAMES.outsiders])
def test_an_effect_changes_parameters_only_at_its_joint_and_vanishes_with_its_size(name):
    rng = np.random.default_rng(8)
    vocabulary = CATALOGUE if name in NAMES else STANDARD_NAMES
    _, gravity, coupling = vocabulary.needs.get(name, ((), False, True))
    robot = draw_robot(rng, "arm", bool(gravity), coupling)
    truth = draw_truth(rng, robot)
    runs = [(robot.pose + 0.1 * np.sin(np.arange(50.0))[:, None], np.ones((50, robot.n)))]
    hidden = vocabulary.draw(rng, name, Site(robot, truth, runs, 1))
    strong, weak = hidden.apply(truth, 3.0), hidden.apply(truth, 1e-9)
    changed = {key for key in NEUTRAL if not np.array_equal(strong[key], truth[key])}
    assert changed
    if hidden.joints:
        assert all(strong[key][0] == truth[key][0] for key in changed)
    grows = [key for key in changed if not np.array_equal(strong[key], weak[key])]
    assert grows
