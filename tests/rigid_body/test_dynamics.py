"""M, C and G of trees: another engine, energies, and the paper's closed forms."""

import dataclasses

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from peer import Peer
from random_trees import mjcf, random_bodies, random_tree

from clie_blocks import manipulator
from clie_blocks.rigid_body.arm import planar_tree
from clie_blocks.rigid_body.dynamics import (
    Rotors,
    bias_torque,
    coriolis_matrix,
    forward_dynamics,
    gravity_torque,
    inverse_dynamics,
    kinetic_energy,
    mass_matrix,
    potential_energy,
    velocity_torque,
)
from clie_blocks.rigid_body.tree import tree

seeds = st.integers(0, 10**6)


def motion(seed, n):
    return np.random.default_rng(seed).normal(size=(3, n))


@pytest.mark.parametrize("seed, n, sliding", [(0, 1, ()), (1, 2, (1,)), (2, 6, ()),
                                              (3, 7, (2, 5)), (4, 7, (0,))])
def test_torques_and_mass_are_those_of_mujoco(seed, n, sliding):
    bodies = random_bodies(seed, n, sliding)
    links = random_tree(seed, n, sliding)
    peer = Peer(mujoco.MjModel.from_xml_string(mjcf(bodies)), links.names)
    for trial in range(5):
        q, dq, ddq = motion(trial, n)
        torque = peer.inverse_dynamics(q, dq, ddq)
        np.testing.assert_allclose(inverse_dynamics(links, q, dq, ddq), torque, rtol=0,
                                   atol=1e-12 * np.abs(torque).max())
        mass = peer.mass_matrix(q)
        np.testing.assert_allclose(mass_matrix(links, q), mass, rtol=0,
                                   atol=1e-12 * np.abs(mass).max())


@given(seeds)
@settings(max_examples=8)
def test_the_terms_make_up_the_torques(seed):
    links = random_tree(seed, 4, (2,))
    q, dq, ddq = motion(seed, 4)
    parts = (mass_matrix(links, q) @ ddq + coriolis_matrix(links, q, dq) @ dq
             + gravity_torque(links, q))
    np.testing.assert_allclose(parts, inverse_dynamics(links, q, dq, ddq), atol=1e-11)
    np.testing.assert_allclose(coriolis_matrix(links, q, dq) @ dq, velocity_torque(links, q, dq),
                               atol=1e-11)
    np.testing.assert_allclose(bias_torque(links, q, dq),
                               velocity_torque(links, q, dq) + gravity_torque(links, q),
                               atol=1e-11)


@given(seeds, st.lists(st.integers(-1, 5), min_size=6, max_size=6), st.sets(st.integers(0, 5)))
@settings(max_examples=15)
def test_composite_bodies_weigh_what_it_takes_to_accelerate_one_joint(seed, parents, sliding):
    """On any tree, branches and sliding joints included."""
    chain = random_tree(seed, 6, tuple(sliding))
    links = dataclasses.replace(chain, parents=tuple(min(j, k - 1)
                                                     for k, j in enumerate(parents)))
    q, (rest, unit) = motion(seed, 6)[0], (np.zeros(6), np.eye(6))
    weightless = links.with_gravity((0.0, 0.0, 0.0))
    columns = [inverse_dynamics(weightless, q, rest, unit[k]) for k in range(6)]
    mass = mass_matrix(links, q)
    np.testing.assert_allclose(mass, np.transpose(columns), atol=1e-12 * np.abs(mass).max())


@given(seeds)
@settings(max_examples=8)
def test_the_motion_under_the_torques_is_the_one_they_were_made_for(seed):
    links = random_tree(seed, 4)
    q, dq, ddq = motion(seed, 4)
    armature = np.array([0.1, 0.0, 0.2, 0.05])
    torque = inverse_dynamics(links, q, dq, ddq) + armature * ddq
    np.testing.assert_allclose(forward_dynamics(links, q, dq, torque, armature), ddq, atol=1e-9)


@given(seeds)
@settings(max_examples=10)
def test_mass_rate_minus_two_c_is_skew(seed):
    links = random_tree(seed, 3, (1,))
    q, dq, _ = motion(seed, 3)
    step = 1e-6
    rate = (mass_matrix(links, q + step * dq) - mass_matrix(links, q - step * dq)) / (2 * step)
    skew = rate - 2 * coriolis_matrix(links, q, dq)
    np.testing.assert_allclose(skew, -skew.T, atol=1e-6)


@given(seeds)
@settings(max_examples=10)
def test_gravity_is_the_slope_of_the_potential_and_power_is_the_rate_of_energy(seed):
    links, step = random_tree(seed, 3, (2,)), 1e-6
    q, dq, ddq = motion(seed, 3)
    slope = [(potential_energy(links, q + step * e) - potential_energy(links, q - step * e))
             / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(gravity_torque(links, q), slope, atol=1e-7)

    def energy(t):
        there = q + t * dq + t**2 * ddq / 2
        return kinetic_energy(links, there, dq + t * ddq) + potential_energy(links, there)

    power = inverse_dynamics(links, q, dq, ddq) @ dq
    assert (energy(step) - energy(-step)) / (2 * step) == pytest.approx(power, abs=1e-6)


def test_a_planar_tree_is_the_arm_of_section_5():
    link = dict(mass=np.array([1.5, 0.8]), length=np.array([0.5, 0.4]), com=np.array([0.2, 0.25]))
    j_link = np.array([0.02, 0.01])
    links = planar_tree(**link, j_link=j_link)
    q, dq, _ = motion(0, 2)
    np.testing.assert_allclose(mass_matrix(links, q),
                               manipulator.mass_matrix(q, **link, j_link=j_link), atol=1e-14)
    np.testing.assert_allclose(coriolis_matrix(links, q, dq),
                               manipulator.coriolis(q, dq, **link), atol=1e-14)
    np.testing.assert_allclose(gravity_torque(links, q), manipulator.gravity(q, **link),
                               atol=1e-14)


def test_time_series_are_evaluated_at_once():
    links = random_tree(1, 4)
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 5, 4))
    torque = inverse_dynamics(links, q, dq, ddq)
    np.testing.assert_allclose(torque[3], inverse_dynamics(links, q[3], dq[3], ddq[3]))
    assert mass_matrix(links, q).shape == (5, 4, 4)
    assert gravity_torque(links, q).shape == torque.shape == (5, 4)


def test_rotors_are_bodies_that_turn_with_their_gears():
    """Second route: each rotor as a body of its own on the link before, turned by its gear."""
    ratio, inertia = np.array([30.0, -50.0]), np.array([2e-4, 1e-4])
    q, dq, ddq = motion(3, 2)
    bodies, rotors = random_bodies(5, 2), []
    for k, body in enumerate(bodies):
        axis = body.axis / np.linalg.norm(body.axis)
        rotors.append(dataclasses.replace(
            body, name=f"rotor{k}", mass=0.0, com=np.zeros(3),
            inertia=inertia[k] / 2 * (np.eye(3) + np.outer(axis, axis))))
    whole = tree([*bodies, *rotors])
    at = [whole.names.index(name) for name in ("j0", "j1", "rotor0", "rotor1")]
    spread = [np.zeros(4) for _ in range(3)]
    for values, of_joints in zip(spread, (q, dq, ddq)):
        values[at] = np.concatenate([of_joints, ratio * of_joints])
    torque = inverse_dynamics(whole, *spread)[at]
    turn = bodies[1].rotation
    bodies[0] = dataclasses.replace(
        bodies[0], inertia=bodies[0].inertia + turn @ rotors[1].inertia @ turn.T)
    with_rotors = inverse_dynamics(tree(bodies), q, dq, ddq, Rotors(inertia, ratio))
    np.testing.assert_allclose(torque[:2] + ratio * torque[2:], with_rotors, atol=1e-11)
