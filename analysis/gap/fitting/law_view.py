"""Fits and residuals of what the law's encoder saw, for searches that look at each run once."""

import dataclasses
from typing import NamedTuple

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.problem.other_encoder import views_of_law
from clie_blocks.analysis.gap.residual.whitening import ResidualModel


class LawView(NamedTuple):
    """A fit and its residuals, and how many times as many samples both encoders have."""

    fit: Fit
    residuals: ResidualModel
    views: float = 1.0


def law_view(fit: Fit, residuals: ResidualModel) -> LawView:
    """Return a fit and its residuals without the views of the other encoder; else as they are."""
    whole = residuals.problem
    if not whole.two_encoders:
        return LawView(fit, residuals)
    problem = views_of_law(whole)
    kept = [j for j, log in enumerate(whole.logs) if not log.of_other_encoder]
    others = {i: residuals.other_noises[j] for i, j in enumerate(kept)
              if j in residuals.other_noises}
    of_law = dataclasses.replace(
        residuals, problem=problem, other_noises=others,
        initial_responses=[residuals.initial_responses[j] for j in kept],
        counted=tuple(residuals.counted[j] for j in kept) if residuals.counted else ())
    reduced = dataclasses.replace(fit, hypothesis=fit.hypothesis.seen_by_law,
                                  chi2=fit.chi2[kept], samples=fit.samples[kept])
    return LawView(reduced, of_law, float(fit.samples.sum() / reduced.samples.sum()))
