import numpy as np
import pytest
import sympy as sp

from clie_blocks import paper
from clie_blocks.identification import (
    adaptation_gain,
    composite_rate,
    composite_update,
    filtered_regressor,
    filtered_regressor_matrix,
    gradient_rate,
    gradient_update,
    identification_error,
    regressor,
    regressor_matrix,
    scaled_gain,
)
from clie_blocks.joints import joint_acceleration
from clie_blocks.signals import DiagramError

N = 2
RNG = np.random.default_rng(3)
DQ, U, E_U, E_F, DQ_F, U_F = RNG.normal(size=(6, N))
THETA = RNG.uniform(0.5, 2.0, 3 * N)
KP, KD = np.array([10.0, 8.0]), np.array([5.0, 3.0])


def test_regressor_times_parameters_is_the_acceleration():
    expected = joint_acceleration(DQ, U, *THETA.reshape(3, N))
    np.testing.assert_allclose(-regressor_matrix(DQ, U).T @ THETA, expected, rtol=1e-13)


def test_regressor_blocks_are_flat_and_row_major():
    np.testing.assert_array_equal(regressor(N).output(0, [], np.concatenate((DQ, U))),
                                  regressor_matrix(DQ, U).reshape(-1))
    np.testing.assert_array_equal(
        filtered_regressor(N, omega_f=300.0).output(0.01, [], np.concatenate((DQ_F, U_F))),
        filtered_regressor_matrix(DQ_F, U_F, 300.0, 0.01).reshape(-1))


def test_filtered_regressor_starts_at_zero_and_settles_at_the_regressor():
    np.testing.assert_array_equal(filtered_regressor_matrix(DQ, U, 300.0, 0.0)[-N:], 0)
    np.testing.assert_allclose(filtered_regressor_matrix(DQ, U, 300.0, 1.0),
                               regressor_matrix(DQ, U), atol=1e-15)


def test_identification_error_vanishes_for_the_true_parameters():
    phi_f = filtered_regressor_matrix(DQ_F, U_F, 300.0, 1.0)
    y_f = -phi_f.T @ THETA
    u = np.concatenate((phi_f.reshape(-1), THETA, y_f))
    np.testing.assert_allclose(identification_error(N).output(0, [], u), 0, atol=1e-14)


@pytest.mark.parametrize("gamma", [20.0, np.arange(1.0, 7.0),
                                   np.diag(np.arange(1.0, 7.0)) + 0.1])
def test_update_laws_equal_the_matrix_formulas(gamma):
    full = gamma * np.eye(3 * N) if np.ndim(gamma) < 2 else gamma
    phi, phi_f = regressor_matrix(DQ, U), filtered_regressor_matrix(DQ_F, U_F, 300.0, 0.02)
    plain = -full @ phi @ np.diag(KD) @ np.linalg.inv(np.diag(KP)) @ E_U  # eq. (27)
    composite = plain + 0.01 * full @ phi_f @ E_F  # eq. (40)
    np.testing.assert_allclose(gradient_rate(phi, E_U, gamma, KP, KD), plain, rtol=1e-12)
    np.testing.assert_allclose(
        composite_rate(phi, E_U, phi_f, E_F, gamma, 0.01, KP, KD), composite, rtol=1e-12)
    block = gradient_update(gamma, KP, KD)
    u = np.concatenate((E_U, phi.reshape(-1)))
    np.testing.assert_allclose(block.dynamics(0, THETA, u), plain, rtol=1e-12)
    block = composite_update(gamma, 0.01, KP, KD)
    u = np.concatenate((u, E_F, phi_f.reshape(-1)))
    np.testing.assert_allclose(block.dynamics(0, THETA, u), composite, rtol=1e-12)


def test_sampled_update_is_one_euler_step():
    phi = regressor_matrix(DQ, U)
    u = np.concatenate((E_U, phi.reshape(-1)))
    block = gradient_update(20.0, KP, KD, period=1e-3)
    assert block.dt == 1e-3
    np.testing.assert_allclose(block.dynamics(0, THETA, u),
                               THETA + 1e-3 * gradient_rate(phi, E_U, 20.0, KP, KD))


@pytest.mark.parametrize("gamma, message", [
    (-1.0, "positive definite"), (np.ones(5), "shape"), (np.zeros(6), "positive definite"),
    (np.triu(np.ones((6, 6))), "symmetric"), (np.ones((6, 6)), "positive definite")])
def test_adaptation_gain_must_be_positive_definite(gamma, message):
    with pytest.raises(DiagramError, match=message):
        adaptation_gain(gamma, N)


def test_negative_alpha_is_refused():
    with pytest.raises(DiagramError, match="alpha must be at least 0"):
        composite_update(20.0, -1e-3, KP, KD)


def test_scaled_gain_gives_every_estimate_the_same_averaged_rate():
    dq, u = RNG.normal(size=(2, 500, N)) * [[[0.1, 0.3]], [[2.0, 5.0]]]
    phi = np.stack([regressor_matrix(*row) for row in zip(dq, u)])
    b = np.array([0.5, 0.4])
    gamma = scaled_gain(phi, 0.3, KP, KD, b)
    weight = np.diag(KD / KP / b)
    rates = np.diag(np.diag(gamma) @ np.mean(phi @ weight @ np.swapaxes(phi, 1, 2), axis=0))
    np.testing.assert_allclose(rates, 0.3, rtol=1e-12)


def test_error_dynamics_input_error_and_lyapunov_derivative_symbolically():
    """Eqs. (24), (26) and (A.2) for one joint, with every symbol free."""
    q, dq, p, dp, q_d, pe = sp.symbols("q dq p dp q_d pe", real=True)
    a, b, kp, kd, gamma = sp.symbols("a b kp kd gamma", positive=True)
    d, a_hat, b_hat, d_hat = sp.symbols("d a_hat b_hat d_hat", real=True)
    u = kp * (q_d - q) - kd * dq + pe
    v = kp * (q_d - p) - kd * dp + pe
    ddq, ddp = -a * dq + b * u - d, -a_hat * dp + b_hat * v - d_hat
    e, de, dde = q - p, dq - dp, ddq - ddp
    a_bar, b_bar = a + b * kd, b * kp
    phi = sp.Matrix([dp, -v, 1])
    theta_err = sp.Matrix([a_hat - a, b_hat - b, d_hat - d])
    assert sp.expand(dde - (-a_bar * de - b_bar * e + (phi.T * theta_err)[0])) == 0  # (24)
    e_u = v - u
    assert sp.expand(e_u - (kp * e + kd * de)) == 0  # (26)
    k_bar = kd / kp * a_bar - 1
    rate = -gamma * phi * kd / kp * e_u  # (27)
    # derivative of (A.1) along the loop, term by term
    derivative = (e_u / kp * (kp * de + kd * dde) + (theta_err.T * rate)[0] / gamma
                  + e * (b_bar * kd * kd / kp + kp * k_bar) * de)
    claimed = -kd * b_bar * e**2 - kd * k_bar * de**2  # (A.2)
    assert sp.simplify(sp.expand(derivative - claimed)) == 0


def test_tables_of_the_paper_are_consistent_with_each_other():
    """Table 2's error column is 100 |error|, which two entries of CASE 1 contradict (errata)."""
    for case in (1, 2, 3):
        error = 100 * np.abs(paper.THETA_HAT[case] - paper.THETA)
        wrong = np.abs(error - paper.ERROR_PRINTED[case]) > 0.0101
        assert wrong.sum() == (2 if case == 1 else 0), case
    assert pytest.approx(paper.K_1_PRINTED - paper.BOUND_31, abs=5e-3) == paper.RHO
