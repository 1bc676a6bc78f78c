"""The noise that models are fed with is that of the sensor, also where the loop amplifies it."""

import dataclasses

import numpy as np
import pytest
from factories import make_fit, make_log, make_problem

from clie_blocks.analysis.gap.fitting.nominal import with_measured_noise
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.linear_filters import frequency_response, high_pass

PERIOD, CORNER, SIGMA, N = 1e-3, 20.0, 1e-4, 12_000
PEAK = METHOD.fitting.loop_peak
TRUTH = SIGMA * np.random.default_rng(7).standard_normal((N, 1))
SLOW = 0.3 * np.sin(2.0 * np.pi * PERIOD * np.arange(N))[:, None]
INNER = slice(1000, -1000)


def logged(inertia, kd):
    """Problem of one joint, and the log that its own model makes with a noise of the sensor."""
    problem = make_problem([SLOW] * 3, period=PERIOD)
    law = dataclasses.replace(problem.stated_law, kd=np.array([kd]))
    nominal = dataclasses.replace(problem.nominal, inertia=np.array([inertia]),
                                  damping=np.array([5e-3]))
    problem = dataclasses.replace(problem, law=law, nominal=nominal)
    reference = make_log(SLOW)
    fed = dataclasses.replace(reference, dither=TRUTH)
    model = make_fit(problem).hypothesis
    q, u = model.simulator.run(fed, model.of_log(0))
    logs = [dataclasses.replace(reference, q=q + TRUTH, u=u) for _ in range(3)]
    return problem.with_log_list(logs)


def peak(problem):
    """Largest gain of S_0 above the corner."""
    b, a = problem.law.sensor_sensitivity(0, problem.nominal.inertia[0],
                                          problem.nominal.damping[0])
    return np.abs(frequency_response(b, a, np.linspace(
        2.0 * np.pi * CORNER * PERIOD, np.pi, 500))).max()


def noise_after(problem, rounds):
    for _ in range(rounds):
        problem = with_measured_noise(make_fit(problem).hypothesis, CORNER, PEAK)
    return problem.logs[0].dither


@pytest.mark.parametrize(("rounds", "most"), [(1, 0.2), (2, 0.15), (4, 0.1)])
def test_the_noise_of_a_light_joint_is_that_of_its_sensor(rounds, most):
    problem = logged(inertia=1.5e-3, kd=0.1)
    assert peak(problem) > 2.0
    expected = high_pass(TRUTH, 2, CORNER, 1.0 / PERIOD)
    error = noise_after(problem, rounds) - expected
    assert error[INNER].std() < most * SIGMA
    plain = high_pass(problem.logs[0].q, 2, CORNER, 1.0 / PERIOD) - expected
    assert plain[INNER].std() > 2.0 * error[INNER].std()


def test_the_noise_of_a_heavy_joint_is_the_error_of_its_model():
    problem = logged(inertia=0.5, kd=8.0)
    assert peak(problem) < 1.2
    model = make_fit(problem).hypothesis
    np.testing.assert_array_equal(with_measured_noise(model, CORNER, PEAK).logs[0].dither,
                                  high_pass(model.error(0), 2, CORNER, 1.0 / PERIOD))
