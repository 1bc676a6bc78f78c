"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.noise_above_motion import HIGHEST_CORNER_SHARE
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.ticks import spread
from clie_blocks.analysis.gap.residual.noise import sensor_noise_model
from clie_blocks.analysis.gap.residual.whitening import (
    DIVERGED,
    NoiseModel,
    ResidualModel,
    residual_model,
)
from clie_blocks.linear_filters import frequency_response, high_pass

_LINES = 400  # at which S_0 is looked at
_MOTIONS = 8  # of a model, that find the noise it lacks
_LEFT = 0.01  # of that noise, where fewer are enough


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
        problem = with_measured_noise(rough, method.fitting.noise_corner,
                                      method.fitting.loop_peak)
        rough = dataclasses.replace(rough, problem=problem)
        residuals = residual_model(problem, rough, method, noise_model)
        before = fit(rough, residuals, 0)
        nominal = fit(rough, residuals, method.fitting.nominal_iterations)
        if nominal.total > kept * before.total and before.total > kept * least:
            break
        rough, least = nominal.hypothesis, nominal.total
    return residuals, nominal


def with_measured_noise(hypothesis: Hypothesis, corner: float, peak: float) -> Problem:
    """Problem whose logs carry the noise of the position above a corner [Hz], by a model's error.

    The noise goes round the loop, of the robot and of the model, which is fed with what the logs
    carry so far.  So the error holds what that lacks as the closed loop shows a noise of the
    sensor: S_0 times it.  Where S_0 has a `peak` above the corner, as of a light joint, the error
    is far larger than the noise, and a model that is fed with it rings on.  Where it has none,
    the error is the noise, and a kick that no model has yet makes no difference.
    """
    problem = hypothesis.problem
    of_runs = [_noise(hypothesis, j, corner, peak)
               for j, log in enumerate(problem.logs) if not log.of_other_encoder]
    return problem.with_log_list([dataclasses.replace(log, dither=of_runs[run])
                                  for run, log in zip(problem.runs, problem.logs)])


def _noise(hypothesis: Hypothesis, j: int, corner: float, peak: float) -> np.ndarray:
    """Noise of the positions in log j above a corner [Hz], at the ticks of samples, (N, n) [rad].

    Of a law that runs more often than it was logged, it is the error of the model there.  What
    the counts of a coarse encoder add is known.
    """
    noise, rounding = (_noise_of_error(hypothesis, j, corner, peak),
                       hypothesis.problem.logs[j].rounding)
    return noise if rounding is None else np.where(rounding.any(axis=0), rounding, noise)


def _noise_of_error(hypothesis: Hypothesis, j: int, corner: float, peak: float) -> np.ndarray:
    log, period = hypothesis.problem.logs[j], hypothesis.problem.period
    rate = 1.0 / (period * log.stride)
    corner = min(corner, HIGHEST_CORNER_SHARE * rate)
    error = hypothesis.error(j)
    if log.stride > 1:
        return spread(high_pass(error[::log.stride], 2, corner, rate), log.stride)
    if _largest_gain(hypothesis, np.linspace(corner, rate / 2.0, _LINES)) > peak:
        error = log.dither + _lacking_noise(hypothesis, j, corner)
    return high_pass(error, 2, corner, rate)


def _largest_gain(hypothesis: Hypothesis, frequency: np.ndarray) -> float:
    """Largest |S_0| of the joints, each by itself, at some frequencies [Hz]."""
    return float(max(np.abs(one).max() for one in _sensitivities(hypothesis, frequency)))


def _sensitivities(hypothesis: Hypothesis, frequency: np.ndarray) -> Iterator[np.ndarray]:
    """S_0 of each joint by itself at some frequencies [Hz]."""
    law, values = hypothesis.problem.law, hypothesis.values
    omega = 2.0 * np.pi * frequency * hypothesis.problem.period
    for k in range(hypothesis.problem.n):
        yield frequency_response(*law.sensor_sensitivity(
            k, values["inertia"][k], values["damping"][k]), omega)


def _lacking_noise(hypothesis: Hypothesis, j: int, corner: float) -> np.ndarray:
    """Noise that log j lacks: fed with all of it, the model leaves just the noise it is fed with.

    S_0, of joints that push one another, is the model itself, so that GMRES solves for the noise
    with some of its motions.
    """
    from scipy.sparse.linalg import LinearOperator, gmres

    problem, log = hypothesis.problem, hypothesis.problem.logs[j]

    def left(more: np.ndarray) -> np.ndarray:
        logs = list(problem.logs)
        logs[j] = dataclasses.replace(log, dither=log.dither + more)
        fed = dataclasses.replace(hypothesis, problem=problem.with_log_list(logs))
        return high_pass(fed.error(j) - logs[j].dither, 2, corner, 1.0 / problem.period)

    start = left(np.zeros_like(log.dither))
    if not np.abs(start).max() < DIVERGED:
        return start
    square = start.size, start.size
    loop = LinearOperator(square, lambda more: (start - left(more.reshape(start.shape))).ravel())
    inverse = _inverse_sensitivity(hypothesis, len(start), corner)
    alone = LinearOperator(square, lambda error: np.fft.irfft(inverse * np.fft.rfft(
        error.reshape(start.shape), axis=0), len(start), axis=0).ravel())
    more, _ = gmres(loop, start.ravel(), rtol=_LEFT, restart=_MOTIONS, maxiter=1, M=alone)
    return np.asarray(more).reshape(start.shape)


def _inverse_sensitivity(hypothesis: Hypothesis, samples: int, corner: float) -> np.ndarray:
    """1 / S_0 of each joint by itself above a corner [Hz], one below it, (frequencies, n)."""
    period = hypothesis.problem.period
    frequency = np.fft.rfftfreq(samples, period)[1:]
    above = np.minimum(frequency / corner, 1.0)[:, None] ** 4
    inverse = 1.0 / np.stack(list(_sensitivities(hypothesis, frequency)), axis=1)
    return np.vstack([np.ones(hypothesis.problem.n), 1.0 + above * (inverse - 1.0)])


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
