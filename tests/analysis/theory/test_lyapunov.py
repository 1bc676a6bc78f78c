"""The Lyapunov functions against sympy, finite differences along runs, and their level sets."""

import numpy as np
import pytest
import sympy as sp

from clie_blocks import paper
from clie_blocks.analysis.stability_report.simulated_bounds import pd_trajectory
from clie_blocks.analysis.theory.bounds import ControlledJoints, ultimate_bound
from clie_blocks.analysis.theory.lyapunov import (
    error_bound,
    level_set_around,
    lyapunov_clie,
    lyapunov_clie_matrices,
    lyapunov_clie_rate,
    lyapunov_pd,
    lyapunov_pd_matrices,
    lyapunov_pd_rate,
)
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import signal

JOINTS = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
PLANT = decoupled_joints(JOINTS.a, JOINTS.b, JOINTS.d)


def along(symbols, names):
    """One joint's symbols as arrays of shape (1,), so that the library's own code runs on them."""
    return [np.array([symbols[name]]) for name in names]


def test_derivative_of_14_is_16_by_algebra():
    """Chain rule on the code's own V along (12), by sympy."""
    names = "dq q_err eta a b kp kd"
    s = dict(zip(names.split(), sp.symbols(names, real=True)))
    w = s["a"] + s["b"] * s["kd"]
    ddq = -w * s["dq"] + s["b"] * s["kp"] * s["q_err"] + s["eta"]
    v = lyapunov_pd(*along(s, ("dq", "q_err")), w, s["b"], s["kp"])
    by_chain = sp.diff(v, s["dq"]) * ddq + sp.diff(v, s["q_err"]) * -s["dq"]
    rate = lyapunov_pd_rate(*along(s, ("dq", "q_err", "eta")), w, s["b"], s["kp"])
    assert sp.nsimplify(sp.expand(by_chain - rate)) == 0


def test_derivative_of_a1_is_a4_by_algebra():
    """Chain rule on (A.1) along (29) and (27); the terms in the estimates cancel."""
    names = "e de eps a b kp kd gamma dq u a_err b_err d_err"
    s = dict(zip(names.split(), sp.symbols(names, positive=True)))
    a_bar, b_bar = s["a"] + s["b"] * s["kd"], s["b"] * s["kp"]
    phi = np.array([s["dq"], -s["u"], sp.Integer(1)])
    theta_err = np.array([s["a_err"], s["b_err"], s["d_err"]])
    dde = -a_bar * s["de"] - b_bar * s["e"] + phi @ theta_err + s["eps"]
    e_u = s["kp"] * s["e"] + s["kd"] * s["de"]
    rates = -s["gamma"] * phi * s["kd"] / s["kp"] * e_u
    v = lyapunov_clie(*along(s, ("e", "de")), theta_err, s["gamma"], a_bar, b_bar, s["kp"],
                      s["kd"])
    by_chain = sp.diff(v, s["e"]) * s["de"] + sp.diff(v, s["de"]) * dde
    by_chain += sum(sp.diff(v, symbol) * rate for symbol, rate in zip(theta_err, rates))
    rate = lyapunov_clie_rate(*along(s, ("e", "de", "eps")), a_bar, b_bar, s["kp"], s["kd"])
    assert sp.nsimplify(sp.simplify(by_chain - rate)) == 0


def test_matrices_are_the_functions():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 2))
    pairs = np.stack((x, y), axis=1)
    p = lyapunov_pd_matrices(JOINTS.a_bar, JOINTS.b, JOINTS.kp)
    assert np.einsum("ki,kij,kj", pairs, p, pairs) / 2 == pytest.approx(
        lyapunov_pd(x, y, JOINTS.a_bar, JOINTS.b, JOINTS.kp))
    p = lyapunov_clie_matrices(JOINTS.a_bar, JOINTS.b_bar, JOINTS.kp, JOINTS.kd)
    assert np.einsum("ki,kij,kj", pairs, p, pairs) / 2 == pytest.approx(
        lyapunov_clie(x, y, np.zeros(6), 20.0, JOINTS.a_bar, JOINTS.b_bar, JOINTS.kp, JOINTS.kd))


def test_rate_of_14_matches_finite_differences_along_a_run():
    time, q_err, dq = pd_trajectory(PLANT, JOINTS, paper.SET_POINT, paper_excitation, 4.0)
    v = lyapunov_pd(dq, q_err, JOINTS.a_bar, JOINTS.b, JOINTS.kp)
    eta = JOINTS.b[:, None] * paper_excitation(time) - JOINTS.d[:, None]
    rate = lyapunov_pd_rate(dq, q_err, eta, JOINTS.a_bar, JOINTS.b, JOINTS.kp)
    np.testing.assert_allclose(np.gradient(v, time)[2:-2], rate[2:-2], atol=2e-3 * np.max(v))


def test_level_set_holds_the_ball_and_lies_in_the_outer_ball():
    p = lyapunov_pd_matrices(JOINTS.a_bar, JOINTS.b, JOINTS.kp)
    found, rng = level_set_around(p, 0.9637), np.random.default_rng(2)
    for _ in range(200):
        x = rng.normal(size=(2, 2))
        v = np.einsum("ki,kij,kj", x, p, x) / 2
        on_ball, on_surface = x * 0.9637 / np.linalg.norm(x), x * np.sqrt(found.level / v)
        assert np.einsum("ki,kij,kj", on_ball, p, on_ball) / 2 <= found.level * (1 + 1e-12)
        assert found.inner <= np.linalg.norm(on_surface) * (1 + 1e-12)
        assert np.linalg.norm(on_surface) <= found.outer * (1 + 1e-12)


def test_the_mu_0_ball_is_not_invariant():
    """A trajectory that starts inside the ball of radius mu_0 leaves it, but not the level set."""
    eta = 0.8768
    bound = ultimate_bound(JOINTS, eta)
    from scipy.linalg import expm

    a = np.array([[-JOINTS.a_bar[0], JOINTS.b_bar[0]], [-1.0, 0.0]])
    x = np.array([-0.2, 0.97]) / np.hypot(0.2, 0.97) * bound.mu_0 * 0.999  # (dq, q_err)
    norms = [np.linalg.norm(expm(a * t) @ x) for t in np.linspace(0, 3, 300)]
    assert norms[0] < bound.mu_0 < max(norms) < bound.invariant.outer


def test_error_bound_holds_along_a_run():
    """V never rises in the matched case: the start of the estimates bounds E for all time."""
    loop = clie_loop(PLANT, JOINTS.kp, JOINTS.kd, 20.0)
    run = compile_diagram(loop).run(20.0, step=1e-3, every=5, inputs={
        "q_d": paper.SET_POINT, "pe": paper_excitation})
    e, de = (signal(run, name) - signal(run, f"{name}_model") for name in ("q", "dq"))
    matrices = lyapunov_clie_matrices(JOINTS.a_bar, JOINTS.b_bar, JOINTS.kp, JOINTS.kd)
    reached = np.max(np.linalg.norm(np.vstack((e, de)), axis=0))
    bound = error_bound(matrices, 20.0, -paper.THETA)
    assert 0.05 < reached < bound < 2.0
