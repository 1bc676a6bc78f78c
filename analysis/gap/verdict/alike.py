"""Names that the logs do not tell apart: the models of their hypotheses move alike.

Which of them is named would rest on what a hypothesis costs, and not on the logs.  So they are one
answer with several names.
"""

import dataclasses
from collections.abc import Collection, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.description import PARAMETRIC, is_number
from clie_blocks.analysis.gap.causes.drive import (
    ACTUATOR_LAG,
    COMMUTATION_RIPPLE,
    GEAR_MESH_RIPPLE,
    TIME_DELAY,
    TORQUE_RIPPLE,
)
from clie_blocks.analysis.gap.causes.friction import DAHL, PRESLIDING
from clie_blocks.analysis.gap.fitting.cache import FitCache
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.alternatives import similar_members
from clie_blocks.analysis.gap.search.candidates import fitted_members
from clie_blocks.analysis.gap.verdict.evidence import Table, contradictions
from clie_blocks.analysis.gap.verdict.posterior import NONE, SET_PROBABILITY, RankedCause

_TWINS = ({ACTUATOR_LAG, TIME_DELAY}, {DAHL, PRESLIDING}, {TORQUE_RIPPLE, GEAR_MESH_RIPPLE},
          {COMMUTATION_RIPPLE, GEAR_MESH_RIPPLE})
_TWIN_STEPS = 4  # of a fit that starts next to where it ends
_ERRORS: FitCache[Fit, list[np.ndarray]] = FitCache()


def names_alike(ranking: Sequence[RankedCause], residuals: ResidualModel,
                causes: Collection[Cause] = ()) -> tuple[tuple[str, ...], ...]:
    """Return the names that stand for each other in the leading hypothesis.

    One name stands for another where a likely hypothesis holds it in the other's place, and its
    model moves as the leading one: they are closer to each other than a right model is to the
    robot, see `Calibration.floor`.  Beside others the nearest rivals may not have been fitted:
    they are now.

    Parameters
    ----------
    ranking : list of RankedCause
        Hypotheses, most probable first.
    residuals : ResidualModel
        The logs, with their noise.
    causes : collection of Cause
        Those that were searched for.

    Returns
    -------
    tuple of tuple of str
        Names that are alike, the leading one first; nothing for a name that has no such rival.

    """
    leading, floor = ranking[0], residuals.method.calibration.floor
    if leading.fit is None or leading.names == (NONE,):
        return ()
    alike: dict[str, dict[str, None]] = {}  # each name once, in order
    for rival in likely_rivals(ranking):
        gone, new = ({*leading.names} - {*rival.names}, {*rival.names} - {*leading.names})
        if (rival.fit is not None and len(gone) == len(new) == 1
                and motion_distance(leading.fit, rival.fit, residuals) <= floor):
            (name,) = gone
            alike.setdefault(name, {name: None}).update(dict.fromkeys(new))
    for name, twin in _untried_twins(leading.fit, ranking, residuals, causes):
        alike.setdefault(name, {name: None})[twin] = None
    return tuple(tuple(names) for names in alike.values())


def _untried_twins(model: Fit, ranking: Sequence[RankedCause], residuals: ResidualModel,
                   causes: Collection[Cause]) -> Iterator[tuple[str, str]]:
    """Names of the leading hypothesis, and others that move alike, of hypotheses never fitted.

    Friction that may differ between the directions need not: a fit that leaves more than with one
    level has ended in a false minimum.  A lag and a delay of one length are often alike, and so
    are contacts that bend before they slide.
    """
    leading, members = ranking[0], fitted_members(model.hypothesis)
    left = {frozenset(ranked.names): ranked.excess for ranked in ranking}
    for member in members:
        name, others = member.cause.name, {*leading.names} - {member.cause.name}
        if name not in leading.names:
            continue
        for cause in causes:
            of_twin = left.get(frozenset({*others, cause.name}), np.inf)
            if (cause.even[:1] == (name,)
                    and of_twin > leading.excess + residuals.method.calibration.floor):
                yield name, cause.name
        for twin in similar_members(member, residuals.problem):
            if ({twin.cause, member.cause} in _TWINS and twin.cause in causes
                    and frozenset({*others, twin.cause.name}) not in left
                    and _moves_alike(model, [twin if one is member else one for one in members],
                                     residuals)):
                yield name, twin.cause.name


def _moves_alike(model: Fit, members: Sequence[Member], residuals: ResidualModel) -> bool:
    """Whether a model with other causes can move as another one does."""
    in_time = dataclasses.replace(residuals, deadline=np.inf)
    rival = fit(build_hypothesis(residuals.problem, members, model.hypothesis), in_time,
                _TWIN_STEPS)
    return motion_distance(model, rival, residuals) <= residuals.method.calibration.floor


def numbers_alike(ranking: Sequence[RankedCause], table: Table, residuals: ResidualModel,
                  ) -> tuple[Fit, ...]:
    """Return the fits that blame other numbers of the robot file, and move as the likeliest does.

    All wrong numbers have one name, and its hypothesis holds the one that does best.  Where the
    model of another one moves just so, beside the same effects, which of the two is wrong does not
    follow from the logs.  Two wrong numbers are no rival of one: each must be wrong on its own.

    Parameters
    ----------
    ranking : list of RankedCause
        Hypotheses, most probable first.
    table : Table
        All evidence, with its fits.
    residuals : ResidualModel
        The logs, with their noise.

    """
    leading = next((ranked.fit for ranked in ranking
                    if ranked.fit is not None and PARAMETRIC in ranked.names), None)
    if leading is None:
        return ()
    method = residuals.method
    kinds, most = {_numbers(leading)}, max(contradictions(leading, method.verdict), 1)
    rivals: list[Fit] = []
    for rival in sorted(table.misdescribed, key=lambda one: one.total):
        if (_numbers(rival) not in kinds and _effects(rival) == _effects(leading)
                and contradictions(rival, method.verdict) <= most
                and motion_distance(leading, rival, residuals) <= method.calibration.floor):
            kinds.add(_numbers(rival))
            rivals.append(rival)
    return tuple(rivals)


def _numbers(fit: Fit) -> frozenset[str]:
    return frozenset(member.cause.key for member in fit.hypothesis.members
                     if is_number(member.cause))


def _effects(fit: Fit) -> frozenset[str]:
    return frozenset(member.cause.name for member in fit.hypothesis.members
                     if not is_number(member.cause))


def motion_distance(one: Fit, other: Fit, residuals: ResidualModel) -> float:
    """Mean squared whitened difference of two models' motions, in the units of an excess."""
    parts = zip(_whitened_errors(one, residuals), _whitened_errors(other, residuals))
    squares = sum(float(np.sum((a - b) ** 2)) for a, b in parts)
    return squares * residuals.problem.n / float(one.samples.sum())


def _whitened_errors(fit: Fit, residuals: ResidualModel) -> list[np.ndarray]:
    """Whitened errors of a fit, joint by joint in each log; a leader meets many rivals."""
    known = _ERRORS.of(residuals)
    if fit not in known:
        known[fit] = [of_joint for j in range(len(residuals.problem.logs)) for of_joint in
                      residuals.whitened(fit.hypothesis.error(j, dithered=False), j)]
    return known[fit]


def likely_rivals(ranking: Sequence[RankedCause]) -> Iterator[RankedCause]:
    """Hypotheses of which the leading one does not hold nine tenths of what the two have.

    How many others there are does not matter: these may be alike as well.
    """
    leading = ranking[0].probability
    for ranked in ranking[1:]:
        if leading < SET_PROBABILITY * (leading + ranked.probability):
            yield ranked
