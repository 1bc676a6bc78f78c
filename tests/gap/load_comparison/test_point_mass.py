"""Torques of a mass anywhere on a link, from ten places."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.load_comparison.point_mass import monomials, torque_columns
from clie_blocks.robot_loop.links import planar_links, tip_load_torque

RNG = np.random.default_rng(3)
LINKS = planar_links([0.4, 0.3], [1.0, 0.5], [0.2, 0.1], [0.01, 0.01], has_gravity=True)


@pytest.fixture
def motion():
    return RNG.normal(size=(3, 20, 2))


def test_a_mass_at_the_tip_takes_the_torque_of_a_load_there(motion):
    columns = torque_columns(LINKS, 1, *motion)
    np.testing.assert_allclose(columns @ monomials(np.array([0.3, 0.0, 0.0])),
                               tip_load_torque(LINKS, *motion), atol=1e-12)


def test_a_mass_at_its_own_joint_takes_nothing_of_that_joint(motion):
    at_joint = torque_columns(LINKS, 1, *motion) @ monomials(np.zeros(3))
    np.testing.assert_allclose(at_joint[:, 1], 0.0, atol=1e-12)
    assert np.abs(at_joint[:, 0]).max() > 0.1


def test_without_gravity_a_mass_at_rest_weighs_nothing(motion):
    q = motion[0]
    columns = torque_columns(planar_links([0.4, 0.3], [1.0, 0.5], [0.2, 0.1], [0.0, 0.0]), 1,
                             q, 0 * q, 0 * q)
    np.testing.assert_allclose(columns, 0.0, atol=1e-12)
