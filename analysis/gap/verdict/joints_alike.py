"""Joints that the logs do not tell apart: a number of another link moves the model as well.

Every drive pushes one coordinate, whose own encoder sees it: what acts there cannot be taken for
what acts at another joint.  A number of a link acts on all joints that carry it, and two links
that hardly move against each other, or weigh at the same place, push these alike.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

from clie_blocks.analysis.gap.causes.description import is_number, stated_numbers
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.fitting.jacobian import Tangent, jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.alike import motion_distance
from clie_blocks.analysis.gap.verdict.evidence import contradictions


def at_other_joints(model: Fit, residuals: ResidualModel) -> tuple[Fit, ...]:
    """Return the fits with a number of another link, that move as a model does.

    Parameters
    ----------
    model : Fit
        A hypothesis whose numbers are left out at joints that do not need them.
    residuals : ResidualModel
        The logs, with their noise.

    """
    method = residuals.method
    floor, most = method.calibration.floor, max(contradictions(model, method.verdict), 1)
    rivals: list[Fit] = []
    for start in _likely_starts(model, residuals):
        if residuals.is_out_of_time:
            break
        rival = fit(start, residuals, method.search.finalist_steps)
        if (contradictions(rival, method.verdict) <= most
                and motion_distance(model, rival, residuals) <= floor):
            rivals.append(rival)
    return tuple(rivals)


def _likely_starts(model: Fit, residuals: ResidualModel) -> Iterator[Hypothesis]:
    """Hypotheses with a number at another joint, where slopes predict that it moves alike."""
    method, problem = residuals.method, model.hypothesis.problem
    allowed = dict(stated_numbers(problem))
    samples = model.samples[:len(problem.fit)].sum() / problem.n
    limit = method.fitting.refit_rise_factor * method.calibration.floor * samples
    for place, member in enumerate(model.hypothesis.members):
        others = [j for j in allowed.get(member.cause, ()) if j not in member.joints]
        if not others or not _is_of_link(member):
            continue
        everywhere = _at_joints(model.hypothesis, place, (*member.joints, *others))
        tangent = jacobian(everywhere, residuals)
        for k in member.joints:
            for j in others:
                kept = tuple(sorted({*member.joints, j} - {k}))
                start, rise = _exchanged(everywhere, tangent, place, k, kept)
                if rise <= limit:
                    yield _at_joints(start, place, kept)


def _is_of_link(member: Member) -> bool:
    """Whether it is a number that acts through the links alone."""
    return is_number(member.cause) and all(
        piece.port == "body" for piece in member.cause.pieces)


def _at_joints(hypothesis: Hypothesis, place: int, joints: tuple[int, ...]) -> Hypothesis:
    """Hypothesis whose cause acts at other joints, with the values that it has there."""
    members = list(hypothesis.members)
    members[place] = dataclasses.replace(members[place], joints=tuple(sorted(joints)))
    return dataclasses.replace(hypothesis, members=tuple(members))


def _exchanged(everywhere: Hypothesis, tangent: Tangent, place: int, k: int,
               kept: tuple[int, ...]) -> tuple[Hypothesis, float]:
    """Hypothesis with a number as stated at joint k, and the rise of the cost that slopes predict.

    All others move as they best make up for it; those of the number at the kept joints only.
    """
    parameters, member = everywhere.free_parameters, everywhere.members[place]
    own = {f"{member.name}.{number.name}" for number in member.cause.numbers}
    gone = [i for i, one in enumerate(parameters) if one.key in own and one.joint == k]
    free = [i for i, one in enumerate(parameters) if one.key not in own or one.joint in kept]
    back = np.array([-everywhere.get(parameters[i]) / parameters[i].size for i in gone])
    matrix = tangent.information
    cross = matrix[np.ix_(free, gone)] @ back
    step = -np.linalg.lstsq(matrix[np.ix_(free, free)], cross, rcond=None)[0]
    rise = back @ matrix[np.ix_(gone, gone)] @ back + cross @ step
    moved = [(parameters[i], np.clip(everywhere.get(parameters[i]) + parameters[i].size * share,
                                     parameters[i].lower, parameters[i].upper))
             for i, share in zip((*gone, *free), (*back, *step))]
    return everywhere.with_values(everywhere.moved(moved)), float(rise)
