"""Motors that turn several joints: virtual work, energy, and the coupling that changes nothing."""

import dataclasses

import numpy as np
import pytest
from random_trees import random_tree

from clie_blocks import compile_diagram
from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body import dynamics
from clie_blocks.rigid_body.arm import articulated_arm
from clie_blocks.rigid_body.dynamics import kinetic_energy, potential_energy
from clie_blocks.rigid_body.motor_coupling import coupling_of, inverse_of, mapped
from clie_blocks.robot_loop.links import (
    bias_torque,
    coupling_torque,
    gravity_torque,
    mass_rows,
    tree_links,
)

C = ((1.0, 0.0, 0.0), (0.4, 1.0, 0.0), (0.0, -0.8, -1.0))
LINKS = random_tree(3, 3)
RNG = np.random.default_rng(0)
Q, DQ, DDQ = RNG.normal(size=(3, 5, 3))
DRIVES = np.full(3, 50.0), np.full(3, 1e-4), np.full(3, 1e-3)


def coupled():
    return tree_links(LINKS, motor_coupling=C)


def test_torques_of_the_motors_do_the_work_of_those_of_the_joints():
    matrix = np.array(C)
    torque = dynamics.inverse_dynamics(LINKS, Q @ matrix.T, DQ @ matrix.T, DDQ @ matrix.T)
    links = coupled()
    rows = np.moveaxis(np.array(mass_rows(links, Q)), -1, 0)
    found = np.einsum("tjk,tk->tj", rows, DDQ) + bias_torque(links, Q, DQ)
    assert found == pytest.approx(torque @ matrix, rel=1e-9)
    weightless = coupling_torque(links, Q, DQ, DDQ) + gravity_torque(links, Q)
    assert weightless == pytest.approx(found - links.diagonal * DDQ, rel=1e-9)


def test_a_coupled_arm_without_friction_keeps_its_energy():
    ratio, rotor, _ = DRIVES
    arm = articulated_arm(LINKS, ratio, rotor, np.zeros(3), motor_coupling=C)
    start = RNG.normal(size=6)

    def energy(x):
        of_motors = np.linalg.inv(C) @ x[3:]
        return (kinetic_energy(LINKS, x[:3], x[3:]) + potential_energy(LINKS, x[:3])
                + 0.5 * ratio**2 * rotor @ of_motors**2)

    path = compile_diagram(arm).run(0.3, step=1e-4, inputs={"u": np.zeros(3)}, every=500,
                                    initial_state=start).outputs.T
    assert np.ptp(path, axis=0).max() > 0.1
    assert [energy(x) for x in path] == pytest.approx([energy(start)] * len(path), rel=1e-7)


def test_a_coupled_arm_moves_as_the_links_of_its_motors_do():
    arm = articulated_arm(LINKS, *DRIVES, motor_coupling=C)
    ratio, rotor, friction = DRIVES
    q, dq, u = Q[0], DQ[0], np.array([0.1, 0.2, 0.3])
    links, of_motors = coupled(), np.linalg.solve(C, np.array([q, dq]).T).T
    mass = np.array(mass_rows(links, of_motors[0])) + np.diag(ratio**2 * rotor)
    torque = (ratio * u - ratio**2 * friction * of_motors[1]
              - bias_torque(links, *of_motors))
    found = arm.dynamics(0.0, np.concatenate((q, dq)), u)[3:]
    assert found == pytest.approx(np.array(C) @ np.linalg.solve(mass, torque), rel=1e-9)


def test_the_identity_is_no_coupling():
    assert coupling_of(np.eye(3), 3) is None
    same = articulated_arm(LINKS, *DRIVES, motor_coupling=np.eye(3))
    plain = articulated_arm(LINKS, *DRIVES)
    x, u = np.concatenate((Q[0], DQ[0])), np.ones(3)
    np.testing.assert_array_equal(same.dynamics(0.0, x, u), plain.dynamics(0.0, x, u))
    plain_links = tree_links(LINKS)
    assert dataclasses.replace(coupled(), motor_coupling=None).layout == plain_links.layout


def test_what_the_inverse_maps_comes_back_and_keeps_holes_where_they_are():
    holes = Q.copy()
    holes[2, 0] = np.nan
    back = mapped(inverse_of(C), mapped(C, holes))
    assert back[[0, 1, 3, 4]] == pytest.approx(Q[[0, 1, 3, 4]], rel=1e-12)
    upper = mapped(((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), holes)
    assert np.isnan(upper[2, 0]) and np.isfinite(upper[2, 1:]).all()


@pytest.mark.parametrize("rows, message", [
    ([[1, 0], [0, 1]], "must be 3 rows of 3 numbers.* 2 x 2"),
    ([[1, 0, 0], [0, 1, 1], [0, 1, 1]], "cannot be inverted"),
    ([[1, 0, 0], [0, np.nan, 1], [0, 1, 1]], "must be finite")])
def test_a_matrix_that_cannot_be_one_is_refused(rows, message):
    with pytest.raises(DiagramError, match=f"plant: motor_coupling {message}"):
        articulated_arm(LINKS, *DRIVES, motor_coupling=rows)
