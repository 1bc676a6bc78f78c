"""Link terms over time series against the arm of the blocks, and against mechanics."""

import numpy as np
import pytest

from clie_blocks import manipulator
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.records import Robot
from clie_blocks.analysis.records.robot_sections import Links, Nominal
from clie_blocks.robot_loop.links import (
    coriolis_torque,
    coupling_torque,
    gravity_torque,
    inertial_torque,
    mass_rows,
    planar_links,
    tip_load_torque,
)


@pytest.fixture
def arm():
    return planar_links([0.32, 0.37], [1.1, 0.56], [0.15, 0.22], [0.0095, 0.0064],
                        has_gravity=True, has_coupling=True, diagonal=[0.2, 0.03])


def test_mass_gravity_and_coriolis_agree_with_the_arm_of_the_blocks(arm):
    rng = np.random.default_rng(0)
    q, dq = rng.normal(size=(2, 7, 2))
    for i in range(7):
        matrix = manipulator.mass_matrix(q[i], arm.mass, arm.length, arm.com_along,
                                         arm.spin_inertia)
        assert np.allclose(matrix, mass_rows(arm, q[i]))
        weight = manipulator.gravity(q[i], arm.mass, arm.length, arm.com_along)
        assert np.allclose(gravity_torque(arm, q)[i], weight)
        coriolis = manipulator.coriolis(q[i], dq[i], arm.mass, arm.length, arm.com_along) @ dq[i]
        assert np.allclose(coriolis_torque(arm, q, dq)[i], coriolis)


@pytest.fixture(params=[2, 4, 6])
def links(request):
    return draw_chain(request.param)


def draw_chain(n, seed=1):
    rng = np.random.default_rng(seed)
    length, mass = rng.uniform(0.2, 0.5, n), rng.uniform(0.3, 1.2, n)
    return planar_links(length, mass, 0.6 * length, 0.05 * mass * length**2, has_gravity=True,
                        has_coupling=True, diagonal=np.linspace(0.5, 0.1, n))


def test_coupling_torque_does_the_work_that_changes_the_kinetic_energy(links):
    time = np.linspace(0.0, 2.0, 20001)[:, None]
    rate, phase = np.linspace(2.0, 3.0, links.n), np.arange(links.n)
    q, dq = np.sin(rate * time + phase), rate * np.cos(rate * time + phase)
    ddq = -rate**2 * q
    energy = 0.5 * (inertial_torque(links, q, dq) * dq).sum(axis=1)
    torque = coupling_torque(links, q, dq, ddq) + links.diagonal * ddq
    power = (torque * dq).sum(axis=1)
    work = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time[:, 0]))))
    assert np.ptp(work) > 0.1
    assert np.allclose(energy - energy[0], work, atol=1e-6 * np.ptp(energy))


def test_gravity_torque_is_the_slope_of_the_potential_energy(links):
    def potential(q):
        angle = np.cumsum(q)
        joints = np.concatenate(([0.0], np.cumsum(links.length * np.sin(angle))))
        return 9.81 * np.sum(links.mass * (joints[:-1] + links.com_along * np.sin(angle)))

    q, step = np.linspace(-1.0, 0.7, links.n), 1e-5 * np.eye(links.n)
    slope = [(potential(q + h) - potential(q - h)) / 2e-5 for h in step]
    assert np.allclose(gravity_torque(links, q), slope, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_mass_and_torque_agree_with_mujoco(n):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    links, rng = draw_chain(n), np.random.default_rng(n)
    model = mujoco.MjModel.from_xml_string(_mujoco_chain(links))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = rng.normal(size=(3, n))
    mujoco.mj_forward(model, data)
    q, dq = data.qpos.copy(), data.qvel.copy()
    matrix, torque = np.zeros((n, n)), np.zeros(n)
    mujoco.mj_fullM(model, data, matrix)
    assert np.allclose(mass_rows(links, q), matrix, rtol=1e-9, atol=1e-12)
    ddq = rng.normal(size=n)
    data.qacc[:] = ddq
    mujoco.mj_rne(model, data, 1, torque)
    coupled = (coupling_torque(links, q, dq, ddq) + links.diagonal * ddq if n > 1
               else inertial_torque(links, q, ddq))
    assert np.allclose(coupled + gravity_torque(links, q), torque, rtol=1e-9,
                       atol=1e-9)


def _mujoco_chain(links):
    inside = ""
    for k in reversed(range(links.n)):
        base, spin = (links.length[k - 1] if k else 0.0), links.spin_inertia[k]
        inside = (f'<body pos="{base} 0 0"><joint axis="0 -1 0"/>'
                  f'<inertial pos="{links.com_along[k]} 0 0" mass="{links.mass[k]}" '
                  f'diaginertia="{spin} {spin} {spin}"/>{inside}</body>')
    return (f'<mujoco><option gravity="0 0 -9.81"/><worldbody>{inside}</worldbody></mujoco>')


def test_one_kilogram_at_the_tip_is_a_pendulum_for_one_joint():
    robot = Robot(n=1, links=Links(length=[0.5], mass=[1.0], com=[0.25], inertia=[0.01]),
                  nominal=Nominal(gravity=True))
    links = stated_links(robot, np.zeros(1))
    still, unit = np.zeros((1, 1)), np.ones((1, 1))
    torque = tip_load_torque(links, still, still, unit)
    assert torque[0, 0] == pytest.approx(0.5**2 + 9.81 * 0.5)
    assert links.diagonal[0] == pytest.approx(0.01 + 0.25**2)
