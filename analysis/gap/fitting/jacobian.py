"""Jacobian of a hypothesis: what a small step on each parameter changes in the residual.

Columns of the Jacobian are finite differences of simulations; parameters that act on different
rows, of other logs or of joints that do not push each other, are moved in one run.
"""

import dataclasses
import functools
import itertools
from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.cache import FitCache
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    FreeParameter,
    Hypothesis,
    residuals_of_sets,
)
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

_KEPT_BYTES = 400_000_000  # of Jacobians: those of arms of six joints fill gigabytes
_KEPT_BORROWED = 4  # Jacobians with columns of other hypotheses: a fit asks for the last two
_LEAST_RELATIVE_SIZE = 0.2  # of a parameter's value, which may be far larger than its size


@dataclasses.dataclass(frozen=True, eq=False)
class Tangent:
    """What a small step on each free parameter of a hypothesis would change.

    Parameters
    ----------
    parts : list of ndarray
        Whitened residual of each joint, log by log.
    residual : ndarray
        All parts, with the distances from the datasheet below.
    columns : ndarray
        Derivatives of the residual to (value / size) of each free parameter.

    """

    parts: list[np.ndarray]
    residual: np.ndarray
    columns: np.ndarray

    @functools.cached_property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)

    @property
    def slopes(self) -> np.ndarray:
        """Columns of the logs, without the datasheet."""
        return self.columns[:len(self.residual) - self.columns.shape[1]]

    @property
    def prior_violation(self) -> np.ndarray:
        """Distances from the datasheet, one per free parameter [standard deviations]."""
        return self.residual[len(self.slopes):]

    @functools.cached_property
    def normal(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrix and right-hand side of the normal equations, without the datasheet.

        In the rows of a joint most columns of the other joints are zero.
        """
        count = self.columns.shape[1]
        matrix, right = np.zeros((count, count)), np.zeros(count)
        ends = np.cumsum([0, *map(len, self.parts)])
        for rows in map(slice, ends, ends[1:]):
            used = np.flatnonzero(self.columns[rows].any(axis=0))
            some = self.columns[rows, used]
            matrix[np.ix_(used, used)] += some.T @ some
            right[used] += some.T @ self.residual[rows]
        return matrix, right

    @property
    def information(self) -> np.ndarray:
        """Matrix of the normal equations with the datasheet."""
        of_prior = self.columns[len(self.slopes):]
        return self.normal[0] + of_prior.T @ of_prior


_TANGENTS: FitCache[Hypothesis, Tangent] = FitCache()
_BORROWED: FitCache[Hypothesis, tuple[Hypothesis, Tangent]] = FitCache()


def jacobian(hypothesis: Hypothesis, residuals: ResidualModel, like: Hypothesis | None = None,
             ) -> Tangent:
    """Return the `Tangent` of a hypothesis; asking again is free, unless it was long ago.

    The columns of what a hypothesis has in common with another one, `like`, may be those of that
    one: residual and cost are exact, and a few steps need no better slopes.
    """
    known = _TANGENTS.of(residuals)
    if hypothesis in known:
        return known[hypothesis]
    if like is not None:
        return _borrowing_jacobian(hypothesis, residuals, like)
    known[hypothesis] = tangent = forward_jacobian(hypothesis, residuals)
    while len(known) > 1 and sum(each.columns.nbytes for each in known.values()) > _KEPT_BYTES:
        del known[next(iter(known))]
    return tangent


def _borrowing_jacobian(hypothesis: Hypothesis, residuals: ResidualModel, like: Hypothesis,
                        ) -> Tangent:
    """`Tangent` with columns of another hypothesis; only the last few are kept."""
    known = _BORROWED.of(residuals)
    if hypothesis not in known or known[hypothesis][0] is not like:
        shared = [one for one in hypothesis.free_parameters if one.of_robot]
        known[hypothesis] = like, _with_columns_of(like, hypothesis, residuals, shared)
        while len(known) > _KEPT_BORROWED:
            del known[next(iter(known))]
    return known[hypothesis][1]


def central_jacobian(hypothesis: Hypothesis, residuals: ResidualModel) -> Tangent:
    """Return the `Tangent` of a hypothesis by central differences.

    A slope to one side holds half the curvature, and passes it for a difference between
    parameters that are alike.
    """
    ahead, behind = jacobian(hypothesis, residuals), forward_jacobian(hypothesis, residuals, -1.0)
    return dataclasses.replace(ahead, columns=(ahead.columns + behind.columns) / 2)


@dataclasses.dataclass(frozen=True)
class _Move:
    """A free parameter a small step away: its place, value, and the step in sizes."""

    index: int
    parameter: FreeParameter
    value: float
    step: float

    def acts_on(self, run: int, joint: int, hypothesis: Hypothesis) -> bool:
        """Whether it changes the residual of a joint in a run."""
        return (self.parameter.log in (None, run)
                and (hypothesis.spreads(self.parameter) or self.parameter.joint in (None, joint)))


def extended_jacobian(hypothesis: Hypothesis, part: Hypothesis, residuals: ResidualModel,
                      ) -> Tangent:
    """Return the `Tangent` of a hypothesis that adds to another one what has no effect as yet.

    The columns that both have are those of the other one: only what is added is simulated.
    """
    return _with_columns_of(part, hypothesis, residuals, hypothesis.free_parameters)


def _with_columns_of(lender: Hypothesis, hypothesis: Hypothesis, residuals: ResidualModel,
                     parameters: Iterable[FreeParameter]) -> Tangent:
    """`Tangent` in which the columns of some parameters are another one's, if it has them."""
    places = {_identity(parameter): i for i, parameter in enumerate(lender.free_parameters)}
    own = {_identity(parameter): i for i, parameter in enumerate(hypothesis.free_parameters)}
    common = [_identity(parameter) for parameter in parameters if _identity(parameter) in places]
    lent, known = [own[key] for key in common], [places[key] for key in common]
    tangent = forward_jacobian(hypothesis, residuals, without=lent)
    slopes = jacobian(lender, residuals).slopes
    for i, j in zip(lent, known):
        tangent.columns[:len(slopes), i] = slopes[:, j]
    return tangent


def _identity(parameter: FreeParameter) -> tuple[str | int | None, ...]:
    return parameter.key, parameter.joint, parameter.log, parameter.axis


def forward_jacobian(hypothesis: Hypothesis, residuals: ResidualModel, side: float = 1.0,
                     without: Collection[int] = ()) -> Tangent:
    """Return a `Tangent` by differences to one side: ahead (1.0) or behind (-1.0).

    Columns of the logs stay zero for the free parameters `without` which it comes.
    """
    method, n = residuals.method.fitting, hypothesis.problem.n
    groups = _groups_of_moves(hypothesis, side * method.difference_step, without)
    sets = [hypothesis.values, *(
        hypothesis.moved([(move.parameter, move.value) for move in group]) for group in groups)]
    runs = list(itertools.chain(*residuals_of_sets(hypothesis, sets, residuals)))
    parts = [run[0] for run in runs]
    violations = hypothesis.prior_violations(method.prior_softness)
    residual = np.concatenate([*parts, violations])
    columns = np.zeros((len(residual), len(hypothesis.free_parameters)), order="F")
    last = 0
    for place, run in enumerate(runs):
        log, joint = divmod(place, n)
        rows = slice(last, last + run.shape[1])
        last = rows.stop
        for group, moved in zip(groups, run[1:]):
            for move in group:
                if move.acts_on(hypothesis.problem.runs[log], joint, hypothesis):
                    columns[rows, move.index] = (moved - run[0]) / move.step
    for i, parameter in enumerate(hypothesis.free_parameters):
        if parameter.tolerance is not None and violations[i] != 0.0:
            columns[last + i, i] = parameter.size / parameter.tolerance / method.prior_softness
    return Tangent(parts, residual, columns)


def changes_of_motion(hypothesis: Hypothesis, log: Log, residuals: ResidualModel,
                      ) -> Iterator[np.ndarray]:
    """Change of the motion of another log by each free parameter [rad per its unit], (N, n) each.

    Parameters of a log are those of the first one.
    """
    moves = [_move(hypothesis, i, residuals.method.fitting.difference_step)
             for i in range(len(hypothesis.free_parameters))]
    sets = [hypothesis.values, *(hypothesis.moved([(move.parameter, move.value)])
                                 for move in moves)]
    runs = hypothesis.simulator.positions(log, [hypothesis.of_log(0, one) for one in sets])
    for move, run in zip(moves, runs[1:], strict=True):
        yield (run - runs[0]).T / (move.step * move.parameter.size)


def _groups_of_moves(hypothesis: Hypothesis, width: float, without: Collection[int],
                     ) -> list[list[_Move]]:
    """Moves that share a run: they are of one key, and each acts on rows of its own."""
    groups: dict[tuple[str | int | None, ...], list[_Move]] = {}
    for i, parameter in enumerate(hypothesis.free_parameters):
        if i not in without:
            alone = parameter.joint if hypothesis.spreads(parameter) else None
            key = parameter.key, alone, parameter.axis
            groups.setdefault(key, []).append(_move(hypothesis, i, width))
    return list(groups.values())


def _move(hypothesis: Hypothesis, i: int, width: float) -> _Move:
    """Free parameter i a small step away, inside its bounds; `width` is a share of its size."""
    parameter = hypothesis.free_parameters[i]
    value, size = hypothesis.get(parameter), parameter.size
    step = width * (size if parameter.phase else max(size, _LEAST_RELATIVE_SIZE * abs(value)))
    if not parameter.lower <= value + step <= parameter.upper:
        step = -step
    return _Move(i, parameter, value + step, step / size)


def joint_columns(fit: Fit, residuals: ResidualModel) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Columns of a fit's parameters and its residual, one array of each per joint, with the prior.

    They are those of the fit logs.  Below their rows both carry one row per parameter: what the
    datasheet allows, and how far beyond it the parameter is, counted at its own joint.  A
    parameter that does not act on the joint is left out.
    """
    tangent, n = jacobian(fit.hypothesis, residuals), fit.hypothesis.problem.n
    by_joint = [_columns_of_joint(fit, tangent, k, n, residuals.method.fitting.prior_softness)
                for k in range(n)]
    return [columns for columns, _ in by_joint], [residual for _, residual in by_joint]


def _columns_of_joint(fit: Fit, tangent: Tangent, k: int, n: int, softness: float,
                      ) -> tuple[np.ndarray, np.ndarray]:
    ends = np.cumsum([0, *(len(part) for part in tangent.parts)])
    rows = np.concatenate([np.arange(ends[place], ends[place + 1])
                           for place in range(k, len(tangent.parts), n)])
    parameters = fit.hypothesis.free_parameters
    used = np.flatnonzero(np.any(tangent.columns[rows], axis=0))
    slopes, violations = _prior_rows([parameters[i] for i in used], fit.prior_violation[used], k,
                                     softness)
    return (np.concatenate([tangent.columns[np.ix_(rows, used)], np.diag(slopes)]),
            np.concatenate([*tangent.parts[k::n], violations]))


def _prior_rows(parameters: Sequence[FreeParameter], violations: np.ndarray, k: int,
                softness: float) -> tuple[np.ndarray, np.ndarray]:
    """Slopes and values of the distances from the datasheet, as joint k counts them."""
    slopes, values = np.zeros(len(parameters)), np.zeros(len(parameters))
    for i, (parameter, violation) in enumerate(zip(parameters, violations)):
        if not parameter.tolerance:
            continue
        slopes[i] = parameter.size / parameter.tolerance
        if violation != 0.0 and parameter.joint == k:
            slopes[i], values[i] = slopes[i] / softness, violation
    return slopes, values
