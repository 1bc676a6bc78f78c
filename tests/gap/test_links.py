"""Link terms over time series against the arm of the blocks, and against mechanics."""

import types

import numpy as np
import pytest

from clie_blocks import manipulator
from clie_blocks.analysis.gap import links


@pytest.fixture
def arm():
    return links.PlanarChain(
        length=np.array([0.32, 0.37]), mass=np.array([1.1, 0.56]), com=np.array([0.15, 0.22]),
        inertia=np.array([0.0095, 0.0064]), bearing_damping=np.array([0.25, 0.1]), g=9.81,
        has_gravity=True, has_coupling=True, diagonal=np.array([0.2, 0.03]), known=True)


def test_mass_gravity_and_coriolis_agree_with_the_arm_of_the_blocks(arm):
    rng = np.random.default_rng(0)
    q, dq = rng.normal(size=(2, 7, 2))
    m_11, m_12, m_22 = links.mass_entries(arm, q[:, 1])
    for i in range(7):
        matrix = manipulator.mass_matrix(q[i], arm.mass, arm.length, arm.com, arm.inertia)
        assert np.allclose(matrix, [[m_11[i], m_12[i]], [m_12[i], m_22]])
        weight = manipulator.gravity(q[i], arm.mass, arm.length, arm.com)
        assert np.allclose(links.gravity_torque(arm, q)[i], weight)
        swirl = manipulator.coriolis(q[i], dq[i], arm.mass, arm.length, arm.com) @ dq[i]
        assert np.allclose(links.coriolis_torque(arm, q, dq)[i], swirl)


def test_coupling_torque_does_the_work_that_changes_the_kinetic_energy(arm):
    time = np.linspace(0.0, 2.0, 20001)
    q = np.stack([np.sin(2 * time), np.cos(3 * time)], axis=1)
    dq = np.stack([2 * np.cos(2 * time), -3 * np.sin(3 * time)], axis=1)
    ddq = np.stack([-4 * np.sin(2 * time), -9 * np.cos(3 * time)], axis=1)
    m_11, m_12, m_22 = links.mass_entries(arm, q[:, 1])
    energy = 0.5 * (m_11 * dq[:, 0]**2 + 2 * m_12 * dq[:, 0] * dq[:, 1] + m_22 * dq[:, 1]**2)
    torque = links.coupling_torque(arm, q, dq, ddq) + arm.diagonal * ddq
    power = (torque * dq).sum(axis=1)
    work = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time))))
    assert np.allclose(energy - energy[0], work, atol=1e-6)


def test_one_kilogram_at_the_tip_is_a_pendulum_for_one_joint():
    stated = types.SimpleNamespace(
        n=1, links=types.SimpleNamespace(
            length=np.array([0.5]), mass=np.array([1.0]), com=np.array([0.25]),
            inertia=np.array([0.01]), joint_viscous_friction=None),
        nominal=types.SimpleNamespace(gravity=True, coupling=False, g=9.81))
    chain = links.planar_chain(stated, [0.0])
    torque = links.tip_load_torque(chain, np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)))
    assert torque[0, 0] == pytest.approx(0.5**2 + 9.81 * 0.5)
    assert chain.diagonal[0] == pytest.approx(0.01 + 0.25**2)
