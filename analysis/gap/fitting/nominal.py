"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

import dataclasses

from clie_blocks.analysis.gap.fitting.hypothesis import hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import residual_model
from clie_blocks.linear_filters import high_pass

DITHER = 20.0  # Hz, above which an error of the model is noise
MOST = 40  # steps: a coupled arm takes many, and an effect must not win what the refit left undone


def fit_nominal(problem):
    """Fit inertia, damping and load of every joint, with the datasheet as prior information.

    Returns
    -------
    bench : Bench
        Whitening for the fitted loop; its problem has the noise seen beside the fitted model.
    base : Fit
        The refitted nominal model.

    """
    start = hypothesis(problem, ())
    rough = fit(start, residual_model(problem, start)).hypothesis
    problem = problem if problem.quiet else with_measured_noise(rough)
    again = dataclasses.replace(rough, problem=problem)
    bench = residual_model(problem, again)
    fits = [fit(again, bench, MOST)]
    if problem.quiet:
        fits.append(fit(start, bench, 0))  # a simulator may be right as it is
    return bench, min(fits, key=lambda found: found.total)


def with_measured_noise(rough, corner=DITHER):
    """Problem whose logs carry the noise of the position: a model's error above a corner [Hz]."""
    problem, rate = rough.problem, 1.0 / rough.problem.period
    corner = min(corner, 0.2 * rate)
    logs = [dataclasses.replace(log, dither=high_pass(rough.error(j), 2, corner, rate))
            for j, log in enumerate(problem.logs)]
    fit_logs = len(problem.fit)
    return dataclasses.replace(problem, fit=tuple(logs[:fit_logs]),
                               held_out=tuple(logs[fit_logs:]))


RATIO = 3.0  # times the misfit of all others, from which on a log is one to learn from
LEAST = 1.0  # excess per sample of a log and joint that says something


def pool_logs(problem, base):
    """Return the problem with all logs to learn from, if the refitted nominal model asks for it.

    Parameters
    ----------
    problem : Problem
        With logs that judge.
    base : Fit
        The nominal model, refitted to the other logs.

    """
    fit = len(problem.fit)
    beyond = base.chi2 / base.samples - 1.0
    learned, judged = beyond[:fit].max(axis=0), beyond[fit:].max(axis=0, initial=0.0)
    if (judged > RATIO * learned.clip(min=LEAST)).any():
        return dataclasses.replace(problem, fit=problem.logs, held_out=())
    return problem
