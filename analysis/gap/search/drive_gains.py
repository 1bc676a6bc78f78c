"""The gain of one drive of an arm, sought from the stated joint model.

A gain that is off scales all torques of a drive, and so do masses and inertias: the refitted joint
model absorbs most of it far beyond the datasheet, and from there the slopes point to the wrong
drive.  Links that are off by no more than their tolerance are near enough to the stated ones.
"""

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TORQUE_GAIN_ERROR
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import extended_jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, predicted_gain
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import compatible, fitted_members
from clie_blocks.analysis.gap.search.racing import training_excess

_ERROR, _SIZE = "error", 0.05
_FITTED = 2  # drives, those of the least predicted costs


def drive_gain_fits(base: Fit, residuals: ResidualModel) -> list[Fit]:
    """Return fits of a wrong gain of one drive each, beside the causes of a fit.

    There are none where that fit keeps to the datasheet or leaves nothing, for a single joint, and
    where no links are stated.

    Parameters
    ----------
    base : Fit
        With or without causes.
    residuals : ResidualModel
        Of the logs.

    """
    problem, members = residuals.problem, fitted_members(base.hypothesis)
    joints = tuple(range(problem.n))
    healthy = residuals.method.calibration.healthy
    if (problem.n == 1 or not problem.links.known or not base.prior_violation.any()
            or training_excess(base) < healthy or residuals.is_out_of_time
            or not all(compatible(one, _gain(joints, problem.n)) for one in members)):
        return []
    everywhere = build_hypothesis(problem, (*members, _gain(joints, problem.n)))
    starts = [build_hypothesis(problem, (*members, _gain((k,), problem.n))) for k in joints]
    starts.sort(key=lambda start: _predicted_cost(start, everywhere, residuals))
    found = [fit(start, residuals, residuals.method.search.leader_steps)
             for start in starts[:_FITTED]]
    return sorted(found, key=training_excess)


def _gain(joints: tuple[int, ...], count: int) -> Member:
    one = np.ones(count)
    return Member(TORQUE_GAIN_ERROR, joints, {_ERROR: 0.0 * one}, {_ERROR: _SIZE * one})


def _predicted_cost(start: Hypothesis, everywhere: Hypothesis, residuals: ResidualModel) -> float:
    """Cost that the slopes at a start predict for the end of its fit."""
    tangent = extended_jacobian(start, everywhere, residuals)
    return tangent.cost - predicted_gain(start, tangent, residuals.method.fitting)
