"""Link terms over time series against the arm of the blocks, and against mechanics."""

import numpy as np
import pytest

from clie_blocks import manipulator
from clie_blocks.analysis.gap.problem import stated_chain
from clie_blocks.analysis.records import Robot
from clie_blocks.analysis.records.robot import Links, Nominal
from clie_blocks.robot_loop import planar_chain


@pytest.fixture
def arm():
    return planar_chain.PlanarChain(
        length=np.array([0.32, 0.37]), mass=np.array([1.1, 0.56]), com=np.array([0.15, 0.22]),
        inertia=np.array([0.0095, 0.0064]), bearing_damping=np.array([0.25, 0.1]), g=9.81,
        has_gravity=True, has_coupling=True, diagonal=np.array([0.2, 0.03]), known=True)


def test_mass_gravity_and_coriolis_agree_with_the_arm_of_the_blocks(arm):
    rng = np.random.default_rng(0)
    q, dq = rng.normal(size=(2, 7, 2))
    for i in range(7):
        matrix = manipulator.mass_matrix(q[i], arm.mass, arm.length, arm.com, arm.inertia)
        assert np.allclose(matrix, planar_chain.mass_matrix(arm, q[i]))
        weight = manipulator.gravity(q[i], arm.mass, arm.length, arm.com)
        assert np.allclose(planar_chain.gravity_torque(arm, q)[i], weight)
        coriolis = manipulator.coriolis(q[i], dq[i], arm.mass, arm.length, arm.com) @ dq[i]
        assert np.allclose(planar_chain.coriolis_torque(arm, q, dq)[i], coriolis)


@pytest.fixture(params=[2, 4, 6])
def chain(request):
    return draw_chain(request.param)


def draw_chain(n, seed=1):
    rng = np.random.default_rng(seed)
    length, mass = rng.uniform(0.2, 0.5, n), rng.uniform(0.3, 1.2, n)
    return planar_chain.PlanarChain(
        length=length, mass=mass, com=0.6 * length, inertia=0.05 * mass * length**2,
        bearing_damping=np.zeros(n), g=9.81, has_gravity=True, has_coupling=True,
        diagonal=np.linspace(0.5, 0.1, n), known=True)


def test_coupling_torque_does_the_work_that_changes_the_kinetic_energy(chain):
    time = np.linspace(0.0, 2.0, 20001)[:, None]
    rate, phase = np.linspace(2.0, 3.0, chain.n), np.arange(chain.n)
    q, dq = np.sin(rate * time + phase), rate * np.cos(rate * time + phase)
    ddq = -rate**2 * q
    energy = 0.5 * (planar_chain.inertial_torque(chain, q, dq) * dq).sum(axis=1)
    torque = planar_chain.coupling_torque(chain, q, dq, ddq) + chain.diagonal * ddq
    power = (torque * dq).sum(axis=1)
    work = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(time[:, 0]))))
    assert np.ptp(work) > 0.1
    assert np.allclose(energy - energy[0], work, atol=1e-6 * np.ptp(energy))


def test_gravity_torque_is_the_slope_of_the_potential_energy(chain):
    def potential(q):
        angle = np.cumsum(q)
        joints = np.concatenate(([0.0], np.cumsum(chain.length * np.sin(angle))))
        return 9.81 * np.sum(chain.mass * (joints[:-1] + chain.com * np.sin(angle)))

    q, step = np.linspace(-1.0, 0.7, chain.n), 1e-5 * np.eye(chain.n)
    slope = [(potential(q + h) - potential(q - h)) / 2e-5 for h in step]
    assert np.allclose(planar_chain.gravity_torque(chain, q), slope, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_mass_and_torque_agree_with_mujoco(n):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    chain, rng = draw_chain(n), np.random.default_rng(n)
    model = mujoco.MjModel.from_xml_string(_mujoco_chain(chain))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = rng.normal(size=(3, n))
    mujoco.mj_forward(model, data)
    q, dq = data.qpos.copy(), data.qvel.copy()
    matrix, torque = np.zeros((n, n)), np.zeros(n)
    mujoco.mj_fullM(model, data, matrix)
    assert np.allclose(planar_chain.mass_matrix(chain, q), matrix, rtol=1e-9, atol=1e-12)
    ddq = rng.normal(size=n)
    data.qacc[:] = ddq
    mujoco.mj_rne(model, data, 1, torque)
    coupled = (planar_chain.coupling_torque(chain, q, dq, ddq) + chain.diagonal * ddq if n > 1
               else planar_chain.inertial_torque(chain, q, ddq))
    assert np.allclose(coupled + planar_chain.gravity_torque(chain, q), torque, rtol=1e-9,
                       atol=1e-9)


def _mujoco_chain(chain):
    inside = ""
    for k in reversed(range(chain.n)):
        base, spin = (chain.length[k - 1] if k else 0.0), chain.inertia[k]
        inside = (f'<body pos="{base} 0 0"><joint axis="0 -1 0"/>'
                  f'<inertial pos="{chain.com[k]} 0 0" mass="{chain.mass[k]}" '
                  f'diaginertia="{spin} {spin} {spin}"/>{inside}</body>')
    return (f'<mujoco><option gravity="0 0 -9.81"/><worldbody>{inside}</worldbody></mujoco>')


def test_one_kilogram_at_the_tip_is_a_pendulum_for_one_joint():
    robot = Robot(n=1, links=Links(length=[0.5], mass=[1.0], com=[0.25], inertia=[0.01]),
                  nominal=Nominal(gravity=True))
    chain = stated_chain.planar_chain(robot, np.zeros(1))
    still, unit = np.zeros((1, 1)), np.ones((1, 1))
    torque = planar_chain.tip_load_torque(chain, still, still, unit)
    assert torque[0, 0] == pytest.approx(0.5**2 + 9.81 * 0.5)
    assert chain.diagonal[0] == pytest.approx(0.01 + 0.25**2)
