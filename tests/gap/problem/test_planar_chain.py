"""Link terms over time series against the arm of the blocks, and against mechanics."""

import types

import numpy as np
import pytest

from clie_blocks import manipulator
from clie_blocks.analysis.gap.problem import planar_chain
from clie_blocks.analysis.gap.simulation import dynamics


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
        swirl = manipulator.coriolis(q[i], dq[i], arm.mass, arm.length, arm.com) @ dq[i]
        assert np.allclose(planar_chain.coriolis_torque(arm, q, dq)[i], swirl)


@pytest.fixture(params=[2, 4, 6])
def chain(request):
    return _drawn(request.param)


def _drawn(n, seed=1):
    rng = np.random.default_rng(seed)
    length, mass = rng.uniform(0.2, 0.5, n), rng.uniform(0.3, 1.2, n)
    return planar_chain.PlanarChain(
        length=length, mass=mass, com=0.6 * length, inertia=0.05 * mass * length**2,
        bearing_damping=np.zeros(n), g=9.81, has_gravity=True, has_coupling=True,
        diagonal=np.linspace(0.5, 0.1, n), known=True)


def test_coupling_torque_does_the_work_that_changes_the_kinetic_energy(chain):
    time = np.linspace(0.0, 2.0, 20001)[:, None]
    rate, turn = np.linspace(2.0, 3.0, chain.n), np.arange(chain.n)
    q, dq = np.sin(rate * time + turn), rate * np.cos(rate * time + turn)
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
def test_mass_and_torque_agree_with_the_engine(n):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    chain, rng = _drawn(n), np.random.default_rng(n)
    model = mujoco.MjModel.from_xml_string(_engine_chain(chain))
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
    found = (planar_chain.coupling_torque(chain, q, dq, ddq) + chain.diagonal * ddq
             + planar_chain.gravity_torque(chain, q)) if n > 1 else (
        planar_chain.inertial_torque(chain, q, ddq) + planar_chain.gravity_torque(chain, q))
    assert np.allclose(found, torque, rtol=1e-9, atol=1e-9)


def _engine_chain(chain):
    inside = ""
    for k in reversed(range(chain.n)):
        at, spin = (chain.length[k - 1] if k else 0.0), chain.inertia[k]
        inside = (f'<body pos="{at} 0 0"><joint axis="0 -1 0"/><inertial pos="{chain.com[k]} 0 0" '
                  f'mass="{chain.mass[k]}" diaginertia="{spin} {spin} {spin}"/>{inside}</body>')
    return (f'<mujoco><option gravity="0 0 -9.81"/><worldbody>{inside}</worldbody></mujoco>')


def test_the_acceleration_solves_the_equation_of_a_chain_behind_gears(chain):
    ratio, rng = np.linspace(3.0, 50.0, chain.n), np.random.default_rng(4)
    rows = planar_chain.mass_matrix(chain, rng.normal(size=chain.n))
    rotor, torque = 1e-3 * ratio, rng.normal(size=chain.n)
    own, cross = dynamics.split_mass(rows)
    found = dynamics.acceleration(torque, rotor + own / ratio, cross / ratio)
    matrix = np.diag(rotor) + np.array(rows) / ratio[:, None]
    assert np.allclose(found, np.linalg.solve(matrix, torque), rtol=1e-9)


def test_stuck_joints_of_a_chain_stay_stuck_and_slipping_ones_feel_their_whole_friction(chain):
    n = chain.n
    own, cross = dynamics.split_mass(planar_chain.mass_matrix(chain, np.linspace(-1.0, 0.7, n)))
    own, dq = own + 0.3, np.linspace(0.3, 1.0, n)
    limits = np.where(np.arange(n) % 2, 1e-3, 10.0)
    after = dynamics.velocity_after_friction(dq, own, cross, (limits, limits), 1.0)
    matrix = cross + 0.3 * np.eye(n)
    impulse = matrix @ (dq - after)
    stuck = np.arange(n) % 2 == 0
    assert np.allclose(after[stuck], 0.0, atol=2e-3)
    assert np.allclose(impulse[~stuck], 1e-3, rtol=1e-6)


def test_one_kilogram_at_the_tip_is_a_pendulum_for_one_joint():
    stated = types.SimpleNamespace(
        n=1, links=types.SimpleNamespace(
            length=np.array([0.5]), mass=np.array([1.0]), com=np.array([0.25]),
            inertia=np.array([0.01]), joint_viscous_friction=None),
        nominal=types.SimpleNamespace(gravity=True, coupling=False, g=9.81))
    chain = planar_chain.planar_chain(stated, [0.0])
    torque = planar_chain.tip_load_torque(
        chain, np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1))
    )
    assert torque[0, 0] == pytest.approx(0.5**2 + 9.81 * 0.5)
    assert chain.diagonal[0] == pytest.approx(0.01 + 0.25**2)
