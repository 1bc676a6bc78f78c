import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from clie_blocks import paper
from clie_blocks.manipulator import GRAVITY, coriolis, gravity, mass_matrix, two_link_arm

angles = st.tuples(st.floats(-3, 3), st.floats(-3, 3)).map(np.array)
LINKS = dict(mass=np.array([0.5, 0.8]), length=np.array([0.6, 0.4]), com=np.array([0.3, 0.25]))
J_LINK = np.array([0.02, 0.03])


def potential(q):
    mass, length, com = LINKS.values()
    height_1 = np.sin(q[0])
    return GRAVITY * (mass[0] * com[0] * height_1
                      + mass[1] * (length[0] * height_1 + com[1] * np.sin(q[0] + q[1])))


@given(angles)
def test_mass_matrix_is_the_kinetic_energy_of_the_bodies(q):
    """Second route: translational and rotational energy of each link from its velocity."""
    mass, length, com = LINKS.values()
    dq = np.array([0.7, -1.3])
    tip = length[0] * dq[0] * np.array([-np.sin(q[0]), np.cos(q[0])])
    angle, rate = q[0] + q[1], dq[0] + dq[1]
    v_2 = tip + com[1] * rate * np.array([-np.sin(angle), np.cos(angle)])
    energy = 0.5 * (mass[0] * (com[0] * dq[0]) ** 2 + J_LINK[0] * dq[0] ** 2
                    + mass[1] * v_2 @ v_2 + J_LINK[1] * rate**2)
    assert 0.5 * dq @ mass_matrix(q, **LINKS, j_link=J_LINK) @ dq == pytest.approx(energy)


@given(angles)
def test_mass_matrix_is_positive_definite(q):
    assert np.all(np.linalg.eigvalsh(mass_matrix(q, **LINKS, j_link=J_LINK)) > 0)


@given(angles, angles)
def test_coriolis_makes_mass_rate_minus_two_c_skew(q, dq):
    step = 1e-6
    rate = (mass_matrix(q + step * dq, **LINKS, j_link=J_LINK)
            - mass_matrix(q - step * dq, **LINKS, j_link=J_LINK)) / (2 * step)
    skew = rate - 2 * coriolis(q, dq, **LINKS)
    np.testing.assert_allclose(skew, -skew.T, atol=1e-7)


@given(angles)
def test_gravity_is_the_slope_of_the_potential(q):
    step = 1e-6
    slope = [(potential(q + step * e) - potential(q - step * e)) / (2 * step) for e in np.eye(2)]
    np.testing.assert_allclose(gravity(q, **LINKS), slope, atol=1e-7)


def total_energy(q, dq, gear_ratio, j_motor):
    inertia = np.diag(gear_ratio**2 * j_motor) + mass_matrix(q, **LINKS, j_link=J_LINK)
    return 0.5 * dq @ inertia @ dq + potential(q)


def test_energy_balance_of_the_arm():
    """Without friction energy is kept; with it the loss is the work of friction; u adds u r dq."""
    gear, rotor, friction = np.array([5.0, 3.0]), np.array([0.01, 0.02]), np.array([0.05, 0.04])
    arm = two_link_arm(**LINKS, gear_ratio=gear, j_motor=rotor, b_motor=friction, j_link=J_LINK,
                       h=[0.1, 0.2])
    torque = np.array([0.8, -0.3])

    def rate(t, x):
        dq = x[2:4]
        loss = gear**2 * friction * dq**2 + np.array([0.1, 0.2]) * dq**2
        return [*arm.dynamics(t, x[:4], torque), np.sum(gear * torque * dq - loss)]

    run = solve_ivp(rate, (0, 2), [0.3, -0.5, 1.0, -2.0, 0.0], rtol=1e-10, atol=1e-12)
    start, end = run.y[:, 0], run.y[:, -1]
    gained = total_energy(end[:2], end[2:4], gear, rotor) - total_energy(
        start[:2], start[2:4], gear, rotor)
    assert gained == pytest.approx(end[4], abs=1e-7)
    assert abs(end[4]) > 0.1


def test_paper_arm_is_the_printed_one():
    """M, C and G of section 5 as printed, with point masses at the tips."""
    m, length, g = 0.5, 0.6, 9.81
    q, dq = np.array([0.4, 0.9]), np.array([1.0, -0.5])
    w_1, w_2 = m * length**2, m * length**2 * np.cos(q[1])
    w_3, slope = m * g * length * np.cos(q[0] + q[1]), -m * length**2 * np.sin(q[1])
    mass = np.array([[2 * m * length**2 + w_1 + 2 * w_2, w_1 + w_2], [w_1 + w_2, w_1]])
    c = np.array([[slope * dq[1], slope * dq.sum()], [-slope * dq[0], 0]])
    torque = np.array([2 * m * g * length * np.cos(q[0]) + w_3, w_3])
    r, j, b = 100.0, 1 / 50, 1 / 25
    u = np.array([0.7, -0.2])
    ddq = np.linalg.solve(j * r * np.eye(2) + mass / r, u - b * r * dq - (c @ dq + torque) / r)
    state = paper.paper_arm().dynamics(0, np.concatenate((q, dq)), u)
    np.testing.assert_allclose(state, np.concatenate((dq, ddq)), rtol=1e-13)
