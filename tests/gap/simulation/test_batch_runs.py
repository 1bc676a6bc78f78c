"""Batches, means, short delay lines and slow filters agree with plain runs and filters."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.causes.sensor import ENCODER_DELAY
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.residual.noise import Rows, decimated, decimation
from clie_blocks.analysis.gap.simulation.closed_loop import TAPS
from clie_blocks.analysis.theory.sampled_loop import decimated_filter


@pytest.fixture(scope="module")
def fitted(healthy):
    return fit_nominal(healthy, METHOD)


def unstable(model):
    """Parameters with which a model diverges."""
    return {**model.values, "damping": -40.0 * model.values["inertia"]}


def test_any_number_of_sets_side_by_side_are_single_runs(fitted):
    model = fitted[1].hypothesis
    sets = [{**model.values, "load": model.values["load"] + 0.01 * k} for k in range(11)]
    batch = model.positions(0, sets)
    assert batch.shape == (11, model.problem.n, len(model.problem.logs[0]))
    for q, values in zip(batch, sets):
        single, _ = model.simulator.run(model.problem.logs[0], model.of_log(0, values))
        np.testing.assert_allclose(q.T, single, rtol=0, atol=1e-11)


def test_residuals_of_many_sets_are_those_of_each_error(fitted):
    residuals, model = fitted[0], fitted[1].hypothesis
    by_joint = residuals.of_runs(model.positions(0, [model.values, unstable(model)]), 0)
    for (stable, diverged), expected in zip(by_joint, residuals.whitened(model.error(0), 0)):
        np.testing.assert_allclose(stable, expected, rtol=0, atol=1e-8)
        assert np.ptp(diverged) == 0.0 < diverged[0]  # a run that diverges is a constant


def test_means_are_those_of_the_positions(fitted):
    model, period = fitted[1].hypothesis, fitted[1].hypothesis.problem.period
    sets = [model.of_log(0, values) for values in (model.values, unstable(model))]
    means, = model.simulator.means(model.problem.logs[:1], sets, decimation(period))
    expected = decimated(model.positions(0, [model.values])[0].T, period).T
    np.testing.assert_allclose(means[0], expected, rtol=0, atol=1e-11)
    assert not np.abs(means[1]).max() < 100.0  # a run that diverges is large or NaN


@pytest.mark.parametrize(("stride", "width"), [(2, 5), (20, 1), (7, 3)])
def test_means_of_a_slow_log_are_those_of_its_samples(fitted, stride, width):
    model = fitted[1].hypothesis
    log = model.problem.logs[0]
    whole = len(log) // stride * stride
    slow = dataclasses.replace(
        log, stride=stride, **{name: getattr(log, name)[:whole]
                               for name in ("q", "u", "q_d", "pe", "dither")})
    means, = model.simulator.means([slow], [model.of_log(0)], width)
    every = model.positions(0, [model.values])[..., :whole]
    expected = Rows(stride, width).of_samples(every[0].T).T
    np.testing.assert_allclose(means[0], expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("cause", [TIME_DELAY, ENCODER_DELAY])
@pytest.mark.parametrize(("samples", "taps"), [
    (7.3, TAPS), (TAPS, TAPS), (TAPS + 0.5, 2 * TAPS), (2.5 * TAPS, 4 * TAPS)])
def test_a_delay_line_is_as_long_as_a_delay_needs(healthy, cause, samples, taps):
    delay = {"delay": samples * healthy.period * np.ones(healthy.n)}
    model = build_hypothesis(healthy, (Member(cause, tuple(range(healthy.n)), delay, delay),))
    log, simulator = healthy.logs[0], model.simulator
    chosen = simulator.for_delays(samples * healthy.period)
    assert chosen.block.pieces[0][1].states == taps
    with_full_line = np.stack(simulator.program.batch(
        len(log) * healthy.period, inputs=np.hstack([log.q_d, log.pe, log.dither]),
        initial_state=simulator.initial_state(log, log.start, model.values), threads=1, log=["q"],
        params={**{key: value[None] for key, value in model.of_log(0).items()},
                "start": log.start[None], "first": log.dither[:1]}).outputs)[..., :len(log)]
    np.testing.assert_allclose(model.positions(0, [model.values]), with_full_line, rtol=0,
                               atol=1e-12)


def test_columns_of_a_jacobian_are_slopes_of_the_residual(fitted):
    residuals, model = fitted[0], fitted[1].hypothesis
    tangent = jacobian(model, residuals)
    assert jacobian(model, residuals) is tangent
    parameter = model.free_parameters[0]
    step = 0.02 * parameter.size
    sides = [jacobian(model.with_values(model.moved([(parameter, model.get(parameter) + change)])),
                      residuals) for change in (-step, step)]
    slope = (sides[1].residual - sides[0].residual) * parameter.size / (2 * step)
    rows = slice(0, sum(len(part) for part in tangent.parts))
    error = np.linalg.norm((tangent.columns[:, 0] - slope)[rows])
    assert error < 0.02 * np.linalg.norm(slope[rows])


def test_a_decimated_filter_gives_the_means_of_the_fast_one(healthy):
    nominal = healthy.nominal
    b, a = healthy.law.torque_sensitivity(0, nominal.inertia[0], nominal.damping[0])
    width = decimation(healthy.period)
    torque = np.repeat(np.random.default_rng(0).standard_normal(300), width)
    expected = decimated(lfilter(b, a, torque), healthy.period)
    filtered = lfilter(*decimated_filter(b, a, width), decimated(torque, healthy.period))
    np.testing.assert_allclose(filtered, expected, rtol=0, atol=1e-5 * np.abs(expected).max())
