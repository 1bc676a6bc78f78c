"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.law import Filter
from clie_blocks.analysis.gap.problem.noise_above_motion import HIGHEST_CORNER_SHARE
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.ticks import spread
from clie_blocks.analysis.gap.residual.noise import sensor_noise_model
from clie_blocks.analysis.gap.residual.whitening import NoiseModel, ResidualModel, residual_model
from clie_blocks.linear_filters import frequency_response, high_pass, lfilter

_PEAK = 1.5  # of S_0 above the corner, from which the error of a model is no noise of the sensor
_LINES = 400  # at which S_0 is looked at
_ON_CIRCLE = 1e-6  # of a root: an integrator of the open loop, which numbers move off the circle


@np.errstate(over="ignore", invalid="ignore")  # by a model that diverges, as `Fit` says
def fit_nominal(problem: Problem, method: Method, noise_model: NoiseModel = sensor_noise_model,
                ) -> tuple[ResidualModel, Fit]:
    """Fit inertia, damping and load of every joint, with the datasheet as prior information.

    The residual model is that of the fitted loop; its problem has the noise that the fitted model
    leaves.
    """
    start = build_hypothesis(problem, ())
    rough = fit(start, residual_model(problem, start, method, noise_model)).hypothesis
    if problem.quiet:
        residuals = residual_model(problem, rough, method, noise_model)
        fits = (fit(rough, residuals, method.fitting.nominal_iterations),
                fit(start, residuals, 0))  # a simulator may be right as it is
        return residuals, min(fits, key=lambda fit: fit.total)
    kept, least = 1.0 - method.fitting.noise_round_gain, 0.0
    for _ in range(method.fitting.noise_rounds):
        problem = with_measured_noise(rough, method.fitting.noise_corner)
        rough = dataclasses.replace(rough, problem=problem)
        residuals = residual_model(problem, rough, method, noise_model)
        before = fit(rough, residuals, 0)
        nominal = fit(rough, residuals, method.fitting.nominal_iterations)
        if nominal.total > kept * before.total and before.total > kept * least:
            break
        rough, least = nominal.hypothesis, nominal.total
    return residuals, nominal


def with_measured_noise(hypothesis: Hypothesis, corner: float) -> Problem:
    """Problem whose logs carry the noise of the position above a corner [Hz], by a model's error.

    The noise goes round the loop, of the robot and of the model, which is fed with what the logs
    carry so far.  So the error holds what that lacks as the closed loop shows a noise of the
    sensor: S_0 times it.  Where S_0 has a peak above the corner, as of a light joint, the error
    is far larger than the noise, and a model that is fed with it rings on.  Where it has none,
    the error is the noise, and a kick that no model has yet makes no difference.
    """
    problem = hypothesis.problem
    of_runs = [_noise(hypothesis, j, corner)
               for j, log in enumerate(problem.logs) if not log.of_other_encoder]
    return problem.with_log_list([dataclasses.replace(log, dither=of_runs[run])
                                  for run, log in zip(problem.runs, problem.logs)])


def _noise(hypothesis: Hypothesis, j: int, corner: float) -> np.ndarray:
    """Noise of the positions in log j above a corner [Hz], at the ticks of samples, (N, n) [rad].

    Of a law that runs more often than it was logged, it is the error of the model there.
    """
    log, period = hypothesis.problem.logs[j], hypothesis.problem.period
    rate = 1.0 / (period * log.stride)
    corner = min(corner, HIGHEST_CORNER_SHARE * rate)
    error = hypothesis.error(j)
    if log.stride > 1:
        return spread(high_pass(error[::log.stride], 2, corner, rate), log.stride)
    noise = error.copy()
    for k in range(hypothesis.problem.n):
        b, a = _sensor_sensitivity(hypothesis, k)
        if _is_peaked(b, a, np.linspace(corner, rate / 2.0, _LINES), rate):
            lacking = high_pass(error[:, k] - log.dither[:, k], 2, corner, rate)
            noise[:, k] = log.dither[:, k] + lfilter(a / b[0], b / b[0], lacking)
    return high_pass(noise, 2, corner, rate)


def _sensor_sensitivity(hypothesis: Hypothesis, k: int) -> Filter:
    """S_0 of joint k as it was fitted."""
    inertia, damping = (hypothesis.values[name][k] for name in ("inertia", "damping"))
    return hypothesis.problem.law.sensor_sensitivity(k, inertia, damping)


def _is_peaked(b: np.ndarray, a: np.ndarray, frequency: np.ndarray, rate: float) -> bool:
    """Whether a filter with a stable inverse has a peak among some frequencies [Hz]."""
    has_inverse = b[0] != 0.0 and np.abs(np.roots(b)).max(initial=0.0) < 1.0 + _ON_CIRCLE
    gain = np.abs(frequency_response(b, a, 2.0 * np.pi * frequency / rate))
    return bool(has_inverse and gain.max() > _PEAK)


def pool_logs(problem: Problem, nominal: Fit, method: Method) -> Problem:
    """Return the problem with all logs to fit, if the refitted nominal model asks for it.

    It does where a hold-out log is much worse than the fit logs: what it shows, they do not.
    """
    fit_logs = len(problem.fit)
    excess = nominal.chi2 / nominal.samples - 1.0
    fitted, held_out = excess[:fit_logs].max(axis=0), excess[fit_logs:].max(axis=0, initial=0.0)
    limit = method.fitting.pooling_ratio * fitted.clip(min=method.fitting.pooling_excess)
    if (held_out > limit).any():
        return dataclasses.replace(problem, fit=problem.logs, held_out=())
    return problem
