"""Torques are linear in the inertial parameters, and motions determine some combinations."""

import numpy as np
import pytest
from random_trees import random_tree

from clie_blocks.rigid_body.arm import planar_tree
from clie_blocks.rigid_body.dynamics import inverse_dynamics
from clie_blocks.rigid_body.inertial_parameters import (
    PER_LINK,
    base_parameters,
    inertial_parameters,
    torque_regressor,
    with_inertial_parameters,
)


def test_the_regressor_times_the_parameters_is_the_torque():
    links = random_tree(2, 4, (1,))
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 6, 4))
    torque = torque_regressor(links, q, dq, ddq) @ inertial_parameters(links)
    np.testing.assert_allclose(torque, inverse_dynamics(links, q, dq, ddq), atol=1e-11)


def test_parameters_go_into_a_tree_and_come_back():
    links = random_tree(3, 3)
    parameters = 1.1 * inertial_parameters(links)
    np.testing.assert_allclose(inertial_parameters(with_inertial_parameters(links, parameters)),
                               parameters)


@pytest.mark.parametrize("links", [planar_tree([1.0], [0.5]), planar_tree([1.0, 2.0], [0.5, 0.4])])
def test_a_planar_arm_in_gravity_shows_two_moments_and_an_inertia_of_each_link(links):
    """Its masses act as part of these [Khalil, Dombre, Modeling of Robots, 2002]."""
    base = base_parameters(links)
    names = sorted((k // len(PER_LINK), PER_LINK[k % len(PER_LINK)]) for k in base.kept)
    assert names == [(k, name) for k in range(links.n) for name in ("Izz", "mx", "my")]


def test_base_parameters_predict_every_torque():
    links = random_tree(4, 3)
    base = base_parameters(links)
    assert len(base) < 10 * links.n
    q, dq, ddq = np.random.default_rng(9).normal(size=(3, 20, 3))
    regressor, parameters = torque_regressor(links, q, dq, ddq), inertial_parameters(links)
    np.testing.assert_allclose(
        regressor[..., list(base.kept)] @ (base.combination @ parameters),
        regressor @ parameters, atol=1e-9)


def test_masses_that_no_motion_tells_apart_are_one_combination():
    """What lies in the null space of the combinations changes no torque."""
    links = random_tree(4, 3)
    base, parameters = base_parameters(links), inertial_parameters(links)
    null = np.linalg.svd(base.combination)[2][len(base):]
    q, dq, ddq = np.random.default_rng(1).normal(size=(3, 5, 3))
    other = with_inertial_parameters(links, parameters + null.sum(axis=0))
    np.testing.assert_allclose(inverse_dynamics(other, q, dq, ddq),
                               inverse_dynamics(links, q, dq, ddq), atol=1e-9)
