"""What is simulated or filtered the quick way is what the plain way gives."""

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.causes.sensor import ENCODER_DELAY
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.residual.noise import decimated, decimation
from clie_blocks.analysis.gap.simulation.closed_loop import SHORT_DELAY_TAPS
from clie_blocks.analysis.theory.sampled_loop import decimated_filter


@pytest.fixture(scope="module")
def fitted(healthy):
    return fit_nominal(healthy, METHOD)


def test_any_number_of_sets_side_by_side_are_single_runs(fitted):
    at = fitted[1].hypothesis
    sets = [{**at.values, "load": at.values["load"] + 0.01 * k} for k in range(11)]
    many = at.positions(0, sets)
    assert many.shape == (11, at.problem.n, len(at.problem.logs[0]))
    for q, values in zip(many, sets):
        alone, _ = at.simulator.run(at.problem.logs[0], at.of_log(0, values))
        np.testing.assert_allclose(q.T, alone, rtol=0, atol=1e-11)


def test_residuals_of_many_sets_are_those_of_each_error(fitted):
    bench, at = fitted[0], fitted[1].hypothesis
    wild = {**at.values, "damping": -40.0 * at.values["inertia"]}
    found = bench.of_runs(at.positions(0, [at.values, wild]), 0)
    for k, part in enumerate(bench.whitened(at.error(0), 0)):
        np.testing.assert_allclose(found[k][0], part, rtol=0, atol=1e-8)
        assert np.ptp(found[k][1]) == 0.0 < found[k][1][0]  # a runaway is a constant


def test_means_are_those_of_the_positions(fitted):
    at, period = fitted[1].hypothesis, fitted[1].hypothesis.problem.period
    wild = {**at.values, "damping": -40.0 * at.values["inertia"]}
    sets = [at.of_log(0, values) for values in (at.values, wild)]
    means = at.simulator.means(at.problem.logs[0], sets, decimation(period))
    expected = decimated(at.positions(0, [at.values])[0].T, period).T
    np.testing.assert_allclose(means[0], expected, rtol=0, atol=1e-11)
    assert not np.abs(means[1]).max() < 100.0  # a runaway, in numbers or out of them


@pytest.mark.parametrize("cause", [TIME_DELAY, ENCODER_DELAY])
@pytest.mark.parametrize("samples", [7.3, SHORT_DELAY_TAPS, SHORT_DELAY_TAPS + 0.5])
def test_a_line_of_delays_is_as_long_as_a_delay_needs(healthy, cause, samples):
    late = {"time": samples * healthy.period * np.ones(healthy.n)}
    at = build_hypothesis(healthy, (Member(cause, tuple(range(healthy.n)), late, late),))
    log, plain = healthy.logs[0], at.simulator
    chosen = plain.for_delays(samples * healthy.period)
    assert (chosen is plain) == (samples > SHORT_DELAY_TAPS)
    long = np.stack(plain.program.batch(
        len(log) * healthy.period, inputs=np.hstack([log.q_d, log.pe, log.dither]),
        initial_state=plain.initial_state(log, at.values), threads=1, log=["q"],
        params={**{key: value[None] for key, value in at.of_log(0).items()},
                "start": log.start[None], "first": log.dither[:1]}).outputs)[..., :len(log)]
    np.testing.assert_allclose(at.positions(0, [at.values]), long, rtol=0, atol=1e-12)


def test_columns_are_slopes_of_the_residual(fitted):
    bench, at = fitted[0], fitted[1].hypothesis
    here = jacobian(at, bench)
    assert jacobian(at, bench) is here
    entry = at.free_parameters[0]
    step = 0.02 * entry.size
    sides = [jacobian(at.with_values(at.moved([(entry, at.get(entry) + sign * step)])), bench)
             for sign in (-1, 1)]
    slope = (sides[1].residual - sides[0].residual) * entry.size / (2 * step)
    rows = slice(0, sum(len(part) for part in here.parts))
    error = np.linalg.norm((here.columns[:, 0] - slope)[rows])
    assert error < 0.02 * np.linalg.norm(slope[rows])


def test_a_slow_filter_gives_the_means_of_the_quick_one(healthy):
    nominal = healthy.nominal
    b, a = healthy.law.torque_sensitivity(0, nominal.inertia[0], nominal.damping[0])
    width = decimation(healthy.period)
    torque = np.repeat(np.random.default_rng(0).standard_normal(300), width)
    expected = decimated(lfilter(b, a, torque), healthy.period)
    found = lfilter(*decimated_filter(b, a, width), decimated(torque, healthy.period))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())
