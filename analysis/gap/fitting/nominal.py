"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.noise_above_motion import HIGHEST_CORNER_SHARE
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.ticks import spread
from clie_blocks.analysis.gap.residual.noise import sensor_noise_model
from clie_blocks.analysis.gap.residual.whitening import NoiseModel, ResidualModel, residual_model
from clie_blocks.linear_filters import high_pass


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
    """Problem whose logs carry the noise of the position: a model's error above a corner [Hz]."""
    problem = hypothesis.problem
    of_runs = [_noise(hypothesis.error(j), log, problem.period, corner)
               for j, log in enumerate(problem.logs) if not log.of_other_encoder]
    return problem.with_log_list([dataclasses.replace(log, dither=of_runs[run])
                                  for run, log in zip(problem.runs, problem.logs)])


def _noise(error: np.ndarray, log: Log, period: float, corner: float) -> np.ndarray:
    """Error of a model above a corner [Hz], at the ticks of the samples, (N, n) [rad]."""
    rate = 1.0 / (period * log.stride)
    noise = high_pass(error[::log.stride], 2, min(corner, HIGHEST_CORNER_SHARE * rate), rate)
    return noise if log.stride == 1 else spread(noise, log.stride)


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
