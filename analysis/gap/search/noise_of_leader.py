"""The noise that models are fed with, once more, by the hypothesis that leads.

It was found with the nominal model.  A soft or loose gear rings in its loop, by noise too, and a
model that has the gear rings along with what the nominal model left of that: its numbers then make
up for it.  With the noise as that model finds it, less is left to make up for.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import with_measured_noise
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.racing import odds_against

_FARTHER = 1.5  # times the way that a fit has moved a number


def with_noise_of_leader(residuals: ResidualModel, nominal: Fit, fits: Sequence[Fit],
                         ) -> tuple[ResidualModel, list[Fit]]:
    """Return the residual model and the fits with the noise that the leader finds in the logs.

    Both stay as they are where no gear of the leader is soft or loose, where it leaves nothing or
    much, and where its noise is no less.

    Parameters
    ----------
    residuals : ResidualModel
        With the noise that the nominal model found.
    nominal : Fit
        The refitted nominal model.
    fits : sequence of Fit
        All hypotheses; those that may lead are fitted again.

    """
    method, problem = residuals.method, residuals.problem
    likely = sorted(fits, key=lambda one: odds_against(one, nominal, method))
    likely = likely[:method.search.alternative_finalists]
    if not likely or not _rings(likely[0], nominal, residuals):
        return residuals, list(fits)
    near = [one for one in likely if one.excess < method.search.far_behind * likely[0].excess]
    plain = min(near, key=lambda one: len(one.hypothesis.free_parameters))
    calm, model = residuals, plain.hypothesis
    for turn in range(method.fitting.noise_rounds):
        calmer = with_measured_noise(model, method.fitting.noise_corner, 0.0)
        if residuals.is_out_of_time or not _is_less(calmer, calm.problem,
                                                    method.fitting.noise_round_gain):
            break
        calm = dataclasses.replace(residuals, problem=calmer)
        before = dataclasses.replace(model, problem=calmer)
        model = fit(before, calm, method.search.first_steps).hypothesis
        if turn < method.fitting.noise_rounds // 2:
            model = _farther(before, model)
    if calm.problem is problem:
        return residuals, list(fits)
    again = {one: fit(dataclasses.replace(one.hypothesis, problem=calm.problem), calm,
                      method.search.finalist_steps) for one in likely}
    again[plain] = min((again[plain], fit(model, calm, method.search.finalist_steps)),
                       key=lambda one: one.total)
    if min(one.excess for one in again.values()) >= likely[0].excess:
        return residuals, list(fits)
    return calm, [again.get(one, one) for one in fits]


def _farther(before: Hypothesis, after: Hypothesis) -> Hypothesis:
    """Hypothesis with numbers of its causes farther than a fit has moved them.

    Noise and numbers are found in turn, and each turn goes about half of the way that is left.
    """
    moved = [(one, before.get(one) + _FARTHER * (after.get(one) - before.get(one)))
             for one in after.free_parameters if not one.of_robot and one.log is None]
    return after.with_values(after.moved(
        [(one, float(np.clip(value, one.lower, one.upper))) for one, value in moved]))


def _rings(leader: Fit, nominal: Fit, residuals: ResidualModel) -> bool:
    """Whether a gear of the leader is soft or loose, and what it leaves may be its noise."""
    method = residuals.method
    least, most = method.calibration.healthy, method.search.hopeless_share * nominal.excess
    return (any(member.cause.moves_apart for member in leader.hypothesis.members)
            and least < leader.excess < most
            and all(log.stride == 1 for log in residuals.problem.logs))


def _is_less(new: Problem, old: Problem, gain: float) -> bool:
    """Whether the noise of no joint is more, and that of one joint less by a share."""
    sizes = np.array([[log.dither.std(axis=0) for log in problem.logs]
                      for problem in (new, old)])
    ratio = np.sqrt(np.mean(sizes[0]**2, axis=0) / (np.mean(sizes[1]**2, axis=0) + 1e-30))
    return bool(ratio.max() < 1.0 + gain and ratio.min() < 1.0 - gain)
