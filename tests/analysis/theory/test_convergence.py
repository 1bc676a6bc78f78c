"""Predicted convergence rates against an independent study and against simulation."""

from dataclasses import replace

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.analysis.theory.convergence import (
    FloquetLoop,
    PeriodicLoop,
    composite_rates,
    floquet_rates,
)
from clie_blocks.excitation import paper_excitation
from clie_blocks.signals import signal

JOINTS = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
LOOP = PeriodicLoop(JOINTS, paper_excitation, q_d=paper.SET_POINT)
RATES = {5: .0077, 10: .0088, 20: .02204, 30: .0389, 40: .0537, 50: .0633, 60: .1037, 70: .1092,
         80: .0936, 100: .0506, 120: .0366, 200: .0239, 400: .0086, 1000: .0032}


@pytest.fixture(scope="module")
def found():
    compiled = FloquetLoop(LOOP)
    return {gamma: compiled.rates(gamma) for gamma in RATES}


def test_rates_are_those_of_an_independent_study(found):
    np.testing.assert_allclose([found[gamma].per_joint[0] for gamma in RATES],
                               list(RATES.values()), atol=6e-5)
    np.testing.assert_allclose(found[20].per_joint, [0.02204, 0.02250], atol=1e-5)


def test_slow_mode_of_the_printed_gain_has_45_s(found):
    assert found[20].time_constant == pytest.approx(45.4, abs=0.1)
    assert found[20].time_to(0.01) == pytest.approx(45.4 * np.log(100), rel=1e-2)


def test_rate_is_not_monotone_and_best_near_70(found):
    best = max(RATES, key=lambda gamma: found[gamma].slowest)
    assert best == 70
    assert found[200].slowest < found[40].slowest < found[70].slowest


@pytest.mark.parametrize("alpha, rate", [(1e-4, .02204), (1e-3, .02200), (1e-2, .0217),
                                         (1.0, .0506)])
def test_the_printed_alphas_do_not_matter(alpha, rate):
    loop = PeriodicLoop(JOINTS, paper_excitation, alpha=alpha)
    assert floquet_rates(loop, [20.0])[0].per_joint[0] == pytest.approx(rate, abs=6e-5)


@pytest.mark.parametrize("gamma", [20.0, 40.0])
def test_simulated_errors_fall_at_the_predicted_rate(gamma, found):
    compiled = FloquetLoop(LOOP)
    run = compiled.program.run(240.0, step=2e-3, inputs=compiled.inputs, every=1000,
                               params={"update.gamma": gamma})
    error = np.abs(signal(run, "theta_hat")[0] - paper.THETA[0])
    late = slice(60, 121, 5)
    slope = -np.polyfit(run.time[late], np.log(error[late]), 1)[0]
    assert slope == pytest.approx(found[gamma].per_joint[0], rel=0.03)


def test_orbit_of_the_true_loop_is_periodic_with_exact_estimates():
    compiled = FloquetLoop(LOOP)
    x, _ = compiled.orbit(20.0)
    np.testing.assert_allclose(compiled.after_period(x[None], 20.0)[0], x, atol=1e-9)
    theta = x[[block == "update" for block in compiled.owners]]
    np.testing.assert_allclose(theta, paper.THETA, atol=1e-9)


def test_states_of_different_joints_are_nudged_together_and_give_the_same_slopes():
    for alpha in (0.0, 1e-2):
        compiled = FloquetLoop(replace(LOOP, alpha=alpha))
        x = compiled.start + np.random.default_rng(1).normal(size=compiled.start.size) * 1e-2
        after, slopes = compiled.monodromy(x, 20.0)
        nudges = 1e-5 * np.eye(x.size)
        up, down = (compiled.after_period(x + sign * nudges, 20.0) for sign in (1, -1))
        np.testing.assert_allclose(slopes, (up - down).T / 2e-5, atol=1e-9)
        np.testing.assert_allclose(after, compiled.after_period(x[None], 20.0)[0], atol=1e-12)


def test_joints_that_are_alike_have_the_same_rate():
    alike = ControlledJoints(*(np.full(4, one) for one in (2.0, 0.5, 0.1, 10.0, 5.0)))
    rates = floquet_rates(PeriodicLoop(alike, paper_excitation), [20.0])[0]
    np.testing.assert_allclose(rates.per_joint, rates.slowest, rtol=1e-6)


def test_rates_over_alpha_are_those_of_each_loop_alone():
    together = composite_rates(LOOP, 20.0, (0.0, 1e-2, 1.0))
    for alpha, rates in zip((0.0, 1e-2, 1.0), together):
        alone = floquet_rates(replace(LOOP, alpha=alpha), [20.0])[0]
        np.testing.assert_allclose(rates.per_joint, alone.per_joint, rtol=1e-5)


def test_without_excitation_nothing_converges():
    rates = floquet_rates(PeriodicLoop(JOINTS, lambda t: 0.0 * t), [20.0])[0]
    assert abs(rates.slowest) < 1e-6
