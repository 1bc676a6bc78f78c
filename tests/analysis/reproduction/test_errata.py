"""A proof of every erratum, by algebra (sympy) or by number."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import trapezoid
from scipy.linalg import expm

from clie_blocks import paper
from clie_blocks.analysis.reproduction.errata import ERRATA
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    theorem_2,
    theorem_4,
    ultimate_bound,
)
from clie_blocks.analysis.theory.convergence import PeriodicLoop, floquet_rates
from clie_blocks.analysis.theory.excitation_level import excitation, model_regressor
from clie_blocks.analysis.theory.frequency import noise_gain
from clie_blocks.analysis.theory.lyapunov import lyapunov_pd_rate
from clie_blocks.compiled import compile_diagram
from clie_blocks.controllers import linearizing_torque, pd_torque
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.excitation import paper_excitation
from clie_blocks.filters import velocity_filter
from clie_blocks.identification import regressor_matrix
from clie_blocks.joints import decoupled_joints, joint_acceleration
from clie_blocks.manipulator import gravity
from clie_blocks.signals import signal

JOINTS = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
PLANT = decoupled_joints(JOINTS.a, JOINTS.b, JOINTS.d)
PROOFS = {}


def proves(key):
    """Register a function as the proof of an erratum."""
    def register(function):
        PROOFS[key] = function
        return function
    return register


@pytest.mark.parametrize("key", [erratum.key for erratum in ERRATA])
def test_erratum_is_proved(key):
    PROOFS[key]()


def test_every_proof_belongs_to_an_erratum():
    assert set(PROOFS) == {erratum.key for erratum in ERRATA}
    assert len(PROOFS) == len(ERRATA)


@proves("disturbance_fraction")
def _():
    ddq, dq, u, tau = sp.symbols("ddq dq u tau")
    j, r, m, h, friction, eta, delta_r, delta_m = sp.symbols("J r m h R eta d_r d_m",
                                                             positive=True)
    link = sp.Eq(m * ddq + h * dq + eta, tau + delta_r)
    motor = sp.Eq(j * r * ddq + friction * r * dq, u - tau / r + delta_m)
    found = sp.solve((link, motor), (ddq, tau))[ddq]
    inertia = j * r + m / r
    d = -found.subs({u: 0, dq: 0})
    assert sp.simplify(d - ((eta - delta_r) / r - delta_m) / inertia) == 0


@proves("disturbance_is_gravity")
def _():
    inertia = paper.GEAR_RATIO * paper.J_MOTOR
    worst = gravity(np.zeros(2), paper.MASS, paper.LENGTH, paper.LENGTH)
    best = gravity(np.array([np.pi / 2, 0]), paper.MASS, paper.LENGTH, paper.LENGTH)
    d = worst / paper.GEAR_RATIO / inertia
    assert d[0] == pytest.approx(0.044, abs=5e-4) and d[0] > 3.5 * paper.THETA[4]
    np.testing.assert_allclose(best, 0, atol=1e-15)


@proves("vector_of_norms")
def _():
    eta_norm, rng = 0.8768, np.random.default_rng(0)
    bound = ultimate_bound(JOINTS, eta_norm)
    script_a = np.diag([np.min(JOINTS.a_bar), np.min(JOINTS.a_bar * JOINTS.b_bar)]) / 2
    assert np.concatenate((JOINTS.kp, JOINTS.kd)).size != len(script_a)  # 2n against 2
    for dq, q_err, eta in rng.normal(size=(200, 3, 2)):
        eta = eta / np.linalg.norm(eta) * eta_norm
        norms = np.array([np.linalg.norm(dq), np.linalg.norm(q_err)])
        estimate = -norms @ script_a @ norms + eta_norm * norms @ [1, np.max(JOINTS.a_bar) / 2]
        rate = lyapunov_pd_rate(dq, q_err, eta, JOINTS.a_bar, JOINTS.b, JOINTS.kp)
        assert rate <= estimate + 1e-12
        if np.linalg.norm(norms) > bound.mu_0:
            assert rate < 0


@proves("ball_not_invariant")
def _():
    bound = ultimate_bound(JOINTS, paper.ETA_NORM)
    assert bound.invariant.blow_up == pytest.approx(4.87, abs=5e-3)
    a = np.array([[-JOINTS.a_bar[0], JOINTS.b_bar[0]], [-1.0, 0.0]])
    start = np.array([-0.2, 0.97]) * 0.999 * bound.mu_0 / np.hypot(0.2, 0.97)
    norms = [np.linalg.norm(expm(a * t) @ start) for t in np.linspace(0, 3, 100)]
    assert norms[0] < bound.mu_0 < max(norms)


@proves("theta_in_v")
def _():
    assert theorem_2(JOINTS, 0.0).mu_1 == 0
    q, dq = np.array([0.3, 0.2]), np.array([0.1, -0.1])
    u = pd_torque(paper.SET_POINT, q, dq, 0.5, JOINTS.kp, JOINTS.kd)
    theta_err = np.array([0.5, 0, 0, 0, 0.1, 0.2])
    dde = regressor_matrix(dq, u).T @ theta_err  # (24) at e = de = 0
    assert np.linalg.norm(dde) > 0.1


@proves("eps_is_minus_dde")
def _():
    dq, u, dp, v = sp.symbols("dq u dp v")
    theta, theta_hat = (sp.Matrix(sp.symbols(f"a{s} b{s} d{s}")) for s in ("", "_hat"))
    phi, phi_p = sp.Matrix([dq, -u, 1]), sp.Matrix([dp, -v, 1])
    ddq = joint_acceleration(dq, u, *theta)
    ddp = joint_acceleration(dp, v, *theta_hat)
    printed = (phi.T @ theta - phi_p.T @ theta_hat)[0]
    assert sp.expand(printed + ddq - ddp) == 0  # = -dde, matched or not
    assert sp.expand(ddq + theta[0] * dq - theta[1] * u + theta[2]) == 0  # the term needed


@proves("k_1")
def _():
    assert theorem_2(JOINTS, 0.0).k_1 == pytest.approx(6.189, abs=1e-9)
    assert np.min(JOINTS.kd * (JOINTS.k_bar + 1)) == pytest.approx(11.189, abs=1e-9)


@proves("k_3")
def _():
    for case, holds in ((2, False), (3, True)):
        found = theorem_4(JOINTS, paper.ALPHA[case], paper.EPS_NORM[case])
        assert found.holds is holds
    alpha, e_f = paper.ALPHA[2], np.array([1.0, 0.0])
    rate = -alpha * e_f @ e_f  # (A.9) at E = 0
    assert rate > -found.k_3_printed * e_f @ e_f and rate <= -alpha * e_f @ e_f


@proves("mu_2_text")
def _():
    one, two = (theorem_4(JOINTS, 1e-3, eps) for eps in (1e-5, 2e-5))
    assert two.mu_2 == pytest.approx(2 * one.mu_2)
    assert two.mu_2_printed == pytest.approx(np.sqrt(2) * one.mu_2_printed)
    eps, eps_f, x, y, z = sp.symbols("eps eps_f x y z", positive=True)
    square = sp.expand((2 * eps**2 + eps_f**2) * (x**2 + y**2 + z**2)
                       - (eps * x + eps * y + eps_f * z) ** 2)
    as_squares = eps**2 * (x - y) ** 2 + (eps * z - eps_f * x) ** 2 + (eps * z - eps_f * y) ** 2
    assert sp.expand(square - as_squares) == 0  # Cauchy-Schwarz gives (A.12)


@proves("conditions_31_46")
def _():
    k, product = sp.symbols("k product", positive=True)
    assert sp.simplify((k - product) / k - (1 - product / k)) == 0
    for eps in (1e-3, 0.5, 0.9, 5.0):
        found = theorem_2(JOINTS, eps)
        assert (found.rho > 0) == (found.mu_1 < 1)


@proves("psi")
def _():
    eps, eps_f, k_4, x, y, z = sp.symbols("eps eps_f k_4 x y z", positive=True)
    needed = k_4 * (eps * x + eps * y + eps_f * z)

    def line(psi):
        return sp.expand(k_4 * eps * eps_f * sum(s * p for s, p in zip((x, y, z), psi)) - needed)

    assert line((1 / eps_f, 1 / eps_f, 1 / eps)) == 0
    assert line((1 / eps, 1 / eps_f, 1 / eps)) != 0


@proves("theorem_4_epsilons")
def _():
    e, de, eps, kp, kd, a_bar, b_bar, drive = sp.symbols("e de eps kp kd a_bar b_bar drive")
    dde = -a_bar * de - b_bar * e + drive + eps  # (29)
    v = (kp * e + kd * de) ** 2 / kp / 2
    rate = sp.expand(sp.diff(v, e) * de + sp.diff(v, de) * dde)
    assert sp.simplify(sp.diff(rate, eps) - (kp * e + kd * de) * kd / kp) == 0
    assert rate.free_symbols == {e, de, eps, kp, kd, a_bar, b_bar, drive}


@proves("output_of_a6")
def _():
    rng = np.random.default_rng(1)
    q, dq, p, dp, u, v = rng.normal(size=(6, 2))
    theta_hat = paper.THETA + rng.normal(size=6)
    v = pd_torque(0.0, p, dp, 0.3, JOINTS.kp, JOINTS.kd)
    u = pd_torque(0.0, q, dq, 0.3, JOINTS.kp, JOINTS.kd)
    dde = (joint_acceleration(dq, u, JOINTS.a, JOINTS.b, JOINTS.d)
           - joint_acceleration(dp, v, *theta_hat.reshape(3, 2)))
    y = dde + JOINTS.a_bar * (dq - dp) + JOINTS.b_bar * (q - p)
    theta_err = theta_hat - paper.THETA
    np.testing.assert_allclose(y, regressor_matrix(dp, v).T @ theta_err)
    assert np.max(np.abs(y - regressor_matrix(dq, u).T @ theta_err)) > 0.1


@proves("solution_44")
def _():
    first, second = (np.outer(phi, phi) for phi in ([1.0, 0.0], [1.0, 1.0]))
    ordered, as_printed = expm(-second) @ expm(-first), expm(-first - second)
    assert np.max(np.abs(ordered - as_printed)) > 0.05
    assert np.linalg.norm(ordered, 2) < 1  # decay all the same
    with pytest.raises(ValueError, match="matmul"):
        np.ones((2, 1)) @ as_printed  # Theta_err(0), a column, cannot stand on the left


@proves("theorem_3_cascade")
def _():
    kd, dq, u = JOINTS.kd, np.array([0.1, 0.2]), np.array([1.0, -1.0])
    rate_of_e_u = kd * (regressor_matrix(dq, u).T @ np.ones(6))  # (24), (26) at e = de = 0
    assert np.min(np.abs(rate_of_e_u)) > 0.1


@proves("filtered_model")
def _():
    t, f, d = sp.symbols("t f d", positive=True)
    answer = (1 - sp.exp(-f * t)) * d
    assert sp.simplify(sp.diff(answer, t) - f * (d - answer)) == 0 and answer.subs(t, 0) == 0


@proves("filter_on_one_side")
def _():
    """With the true parameters, no noise, no adaptation to speak of."""
    loop = clie_composite(PLANT, paper.KP, paper.KD, 1e-12, 0.0)
    run = compile_diagram(loop).run(10.0, step=1e-3, every=5, log=["e_f"], inputs={
        "q_d": paper.SET_POINT, "pe": paper_excitation, "noise": 0.0},
        initial_state={"update": paper.THETA})
    late = run.time > 5
    assert 0.01 < np.max(np.abs(signal(run, "e_f")[:, late])) < 0.1


@proves("weighted_pe")
def _():
    loop = clie_loop(paper.paper_arm(), paper.KP, paper.KD, paper.GAMMA)
    run = compile_diagram(loop).run(25.0, step=1e-3, every=5,
                                    inputs={"q_d": paper.SET_POINT, "pe": 0.0})
    found = excitation(model_regressor(run), run.time, (15, 25))
    assert found.weighted == pytest.approx(3.286, abs=1e-3) and found.rank == 2


@proves("sign_in_50")
def _():
    names = "q_d dq_d ddq_d q dq a b d kp kd"
    s = dict(zip(names.split(), sp.symbols(names)))

    def acceleration(sign):
        u = linearizing_torque(s["q_d"], s["dq_d"], s["ddq_d"], s["q"], s["dq"], s["a"], s["b"],
                               sign * s["d"], s["kp"], s["kd"])
        return joint_acceleration(s["dq"], u, s["a"], s["b"], s["d"])

    wanted = s["ddq_d"] + s["kp"] * (s["q_d"] - s["q"]) + s["kd"] * (s["dq_d"] - s["dq"])
    assert sp.simplify(acceleration(1) - wanted) == 0
    assert sp.simplify(acceleration(-1) - wanted + 2 * s["d"]) == 0


@proves("percent_column")
def _():
    for case in (2, 3):
        error = 100 * np.abs(paper.THETA_HAT[case] - paper.THETA)
        np.testing.assert_allclose(error, paper.ERROR_PRINTED[case], atol=5.1e-3)
    relative = [np.abs(paper.THETA_HAT[case] / paper.THETA - 1)[4:] for case in (1, 2, 3)]
    assert np.min(relative) == pytest.approx(0.13, abs=5e-3)
    assert np.max(relative) == pytest.approx(0.92, abs=5e-3)


@proves("case_1_column")
def _():
    error = 100 * np.abs(paper.THETA_HAT[1] - paper.THETA)
    wrong = np.abs(error - paper.ERROR_PRINTED[1]) > 5.1e-3
    assert list(np.flatnonzero(wrong)) == [3, 4]
    np.testing.assert_allclose(error[wrong], [0.15, 0.19], atol=1e-9)


@proves("real_b_2")
def _():
    a_1, a_2, b_1, b_2 = paper.THETA[:4]
    friction = paper.GEAR_RATIO * paper.B_MOTOR
    np.testing.assert_allclose(friction, 4)
    assert abs(a_1 / b_1 - 4) < 1e-3 and a_2 / b_2 == pytest.approx(3.992, abs=1e-3)
    assert a_2 / 4 == pytest.approx(0.4988, abs=5e-5)
    swapped = ControlledJoints.from_theta([a_1, a_2, b_1, 0.4988, 0, 0], paper.KP, paper.KD)
    assert ultimate_bound(swapped, paper.ETA_NORM).mu_0 == pytest.approx(0.9635, abs=1e-3)
    assert round(ultimate_bound(swapped, paper.ETA_NORM).mu_0, 4) != 0.9637


@proves("eps_norms")
def _():
    norms = {case: np.hypot(*means) for case, means in paper.EPS_MEAN.items()}
    assert norms[1] == pytest.approx(2.356e-5, abs=1e-8)
    assert norms[3] == pytest.approx(8.853e-5, abs=1e-8)
    assert abs(norms[3] - paper.EPS_NORM[3]) > 5e-8


@proves("tracking_exponent")
def _():
    loop = feedback_linearization(paper.paper_arm(), paper.THETA_HAT[1], paper.KP, paper.KD)
    run = compile_diagram(loop).run(100.0, step=1e-3, inputs={
        "q_d": paper.tracking_reference, "dq_d": paper.tracking_velocity,
        "ddq_d": paper.tracking_acceleration})
    error = paper.tracking_reference(run.time) - signal(run, "q")
    np.testing.assert_allclose(np.mean(error**2, axis=1), paper.TRACKING_MSE[1], rtol=1e-3)


@proves("telescoping_mean")
def _():
    loop = clie_loop(PLANT, paper.KP, paper.KD, 1e-12)  # frozen, wrong estimates
    run = compile_diagram(loop).run(100.0, step=1e-3, every=1, inputs={
        "q_d": paper.SET_POINT, "pe": paper_excitation},
        initial_state={"update": paper.THETA_HAT[3]})
    de = signal(run, "dq") - signal(run, "dq_model")
    eps = -np.gradient(de, run.time, axis=1)  # the printed (29)
    mean = trapezoid(eps, run.time, axis=1) / 100.0
    np.testing.assert_allclose(mean, (de[:, 0] - de[:, -1]) / 100.0, atol=1e-7)
    assert np.all(np.abs(mean) < 0.01 * np.max(np.abs(eps), axis=1))


@proves("two_inertias")
def _():
    j_motor, j_link, m, r = sp.symbols("J_motor J_link m r", positive=True)
    inertia = j_motor * r + (m + j_link) / r
    assert sp.diff(inertia, j_motor) == r and sp.diff(inertia, j_link) == 1 / r


@proves("noise_variance")
def _():
    noise = noise_gain(velocity_filter(1), paper.STEP) * np.sqrt(paper.NOISE_VARIANCE_PRINTED)
    speed = 0.054  # rad/s, the velocity itself
    assert noise == pytest.approx(0.60, abs=0.01) and noise > 10 * speed
    assert noise * np.sqrt(1e-3) < 0.4 * speed


@proves("gain_and_duration")
def _():
    slow = floquet_rates(PeriodicLoop(JOINTS, paper_excitation), [paper.GAMMA])[0]
    assert slow.time_constant == pytest.approx(45.4, abs=0.1)
    assert 0.1 < np.exp(-100 / slow.time_constant) < 0.12
    fast = floquet_rates(PeriodicLoop(JOINTS, paper_excitation), [3.5 * paper.GAMMA])[0]
    assert np.exp(-100 / fast.time_constant) < 1e-4


@proves("composite_convergence")
def _():
    rates = [floquet_rates(PeriodicLoop(JOINTS, paper_excitation, alpha=alpha), [20.0])[0].slowest
             for alpha in (0.0, paper.ALPHA[2], paper.ALPHA[3])]
    np.testing.assert_allclose(rates, rates[0], rtol=3e-3)
    run = compile_diagram(clie_loop(PLANT, paper.KP, paper.KD, 1e-12)).run(
        30.0, step=1e-3, every=5, initial_state={"update": paper.THETA},
        inputs={"q_d": paper.SET_POINT, "pe": paper_excitation})
    weakest = excitation(model_regressor(run), run.time, (20, 30)).smallest / 10
    for alpha, expected in ((1e-4, 2.0e5), (1e-3, 2.0e4)):
        assert 1 / (alpha * paper.GAMMA * weakest) == pytest.approx(expected, rel=0.05)
