"""The nominal model, refitted: the gap that no change of inertia, damping and offset removes."""

import dataclasses

from clie_blocks.analysis.gap.bench import bench_of
from clie_blocks.analysis.gap.filtering import high_passed
from clie_blocks.analysis.gap.fit import fit
from clie_blocks.analysis.gap.hypothesis import hypothesis

DITHER = 20.0  # Hz, above which an error of the model is noise
MOST = 40  # steps: a coupled arm takes many, and an effect must not win what the refit left undone


def baseline(problem):
    """Fit inertia, damping and load of every joint, with the datasheet as prior information.

    Returns
    -------
    bench : Bench
        Whitening for the fitted loop; its problem has the noise seen beside the fitted model.
    base : Fit
        The refitted nominal model.

    """
    start = hypothesis(problem, ())
    rough = fit(start, bench_of(problem, start)).hypothesis
    problem = problem if problem.quiet else noisy(rough)
    again = dataclasses.replace(rough, problem=problem)
    bench = bench_of(problem, again)
    fits = [fit(again, bench, MOST)]
    if problem.quiet:
        fits.append(fit(start, bench, 0))  # a simulator may be right as it is
    return bench, min(fits, key=lambda found: found.total)


def noisy(rough, corner=DITHER):
    """Problem whose logs carry the noise of the position: a model's error above a corner [Hz]."""
    problem, rate = rough.problem, 1.0 / rough.problem.period
    corner = min(corner, 0.2 * rate)
    logs = [dataclasses.replace(log, dither=high_passed(rough.error(j), 2, corner, rate))
            for j, log in enumerate(problem.logs)]
    fit_logs = len(problem.fit)
    return dataclasses.replace(problem, fit=tuple(logs[:fit_logs]),
                               held_out=tuple(logs[fit_logs:]))
