"""What each of several causes takes of the gap: alone, last, and on average over all orders.

The robot is simulated with each part of its causes, and what these do beyond what inertia, damping
and load could follow is what the gap would be if it had no others.  So shares do not depend on
which sets of causes were fitted.  They are of the gap, in which all frequencies count alike, and
not of the whitened errors by which causes compete.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.fitting.cache import FitCache
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, Values
from clie_blocks.analysis.gap.fitting.jacobian import forward_jacobian
from clie_blocks.analysis.gap.residual.noise import whiten
from clie_blocks.analysis.gap.residual.whitening import DIVERGED, ResidualModel, unweighted
from clie_blocks.analysis.gap.simulation.batch_runs import WIDE


@dataclasses.dataclass(frozen=True)
class Share:
    """Shares of the gap of the refitted nominal model, in squares.

    They are negative where a cause hides what others do.

    Parameters
    ----------
    alone : float
        What the gap would be if the robot had this cause alone.
    last : float
        What the gap would lose without it.
    mean : float
        What it adds on average over the orders in which the causes can be added (Shapley's
        value); these add up to what all of them take together.
    simpler : str or None
        Name of the simpler cause that it contains, such as the Coulomb friction of one that
        varies; None where it contains none.
    as_simpler : float
        What the gap would lose, of `last`, with that one in its place.

    """

    alone: float
    last: float
    mean: float
    simpler: str | None = None
    as_simpler: float = 0.0


class _Nominal(NamedTuple):
    """A nominal model in all logs, fitted or held out.

    Parameters
    ----------
    residuals : ResidualModel
        Of errors as the gap counts them.
    slopes : ndarray, shape (rows, parameters)
        What its parameters do in all logs.
    allowed : ndarray, shape (parameters,)
        Over their tolerances.
    follows : ndarray, shape (parameters, rows of the fitted logs)
        How far they follow a change.

    """

    residuals: ResidualModel
    slopes: np.ndarray
    allowed: np.ndarray
    follows: np.ndarray


_NOMINALS: FitCache[Fit, _Nominal] = FitCache()


def shares_of(fit: Fit, nominal: Fit, residuals: ResidualModel) -> dict[str, Share]:
    """Share of each cause of a fitted hypothesis, by name.

    Parameters
    ----------
    fit : Fit
        The hypothesis.
    nominal : Fit
        The refitted nominal model.
    residuals : ResidualModel
        Of the logs.

    """
    names = sorted({member.cause.name for member in fit.hypothesis.members})
    sets = [frozenset(some) for count in range(len(names) + 1)
            for some in itertools.combinations(names, count)]
    general = {member.cause.name: member for member in fit.hypothesis.members
               if member.cause.without}
    gap = _gaps(fit, [*(_without(fit, set(names) - some) for some in sets),
                      *(_as_simpler(fit, member) for member in general.values())],
                nominal, residuals)
    together = min(max(1.0 - max(fit.excess, 0.0) / max(nominal.excess, 1e-9), 0.0), 1.0)
    whole = gap[len(sets) - 1]
    share = together * gap / whole if whole > 0.0 else 0.0 * gap
    found = cause_shares(names, dict(zip(sets, share)))
    for (name, member), of_simpler in zip(general.items(), share[len(sets):]):
        without_it = share[sets.index(frozenset(names) - {name})]
        found[name] = dataclasses.replace(found[name], simpler=member.cause.without[0],
                                          as_simpler=float(of_simpler - without_it))
    return found


def _without(fit: Fit, names: Collection[str]) -> Values:
    """Values of a hypothesis with which some of its causes do nothing."""
    values = dict(fit.hypothesis.values)
    for member in fit.hypothesis.members:
        for number in member.cause.numbers:
            if member.cause.name in names and number.neutral is not None:
                key = f"{member.name}.{number.name}"
                values[key] = np.full_like(np.asarray(values[key], float), number.neutral)
    return values


def _as_simpler(fit: Fit, member: Member) -> Values:
    """Values of a hypothesis with the simpler cause that one of its causes contains."""
    values, (_, *parameters) = dict(fit.hypothesis.values), member.cause.without
    for number in member.cause.numbers:
        if number.name in parameters:
            key = f"{member.name}.{number.name}"
            values[key] = np.full_like(np.asarray(values[key], float), max(number.lower, 0.0))
    return values


def _gaps(fit: Fit, sets: Sequence[Values], nominal: Fit, residuals: ResidualModel) -> np.ndarray:
    """Squares of what each set of values does beyond the first in all logs, shape (sets,).

    What the parameters of the nominal model can follow, as far as the datasheet allows it, is
    left out; as in the gap, they are those that follow the fitted logs best.
    """
    problem, seen = residuals.problem, _in_all_logs(nominal, residuals)
    changes = [_changes(fit, j, sets) for j in range(len(problem.logs))]
    change = np.concatenate([
        seen.residuals.without_initial_response(
            whiten(runs[:, k].T, seen.residuals.noise(j, k).whitener), j, k)
        for j, runs in enumerate(changes) for k in range(problem.n)])
    followed = seen.follows @ change[:seen.follows.shape[1]]
    return np.sum((change - seen.slopes @ followed)**2, axis=0) + np.sum(
        (seen.allowed[:, None] * followed)**2, axis=0)


def _in_all_logs(nominal: Fit, residuals: ResidualModel) -> _Nominal:
    known, problem = _NOMINALS.of(residuals), residuals.problem
    if nominal not in known:
        together = dataclasses.replace(problem, fit=problem.logs, held_out=())
        seen = unweighted(dataclasses.replace(residuals, problem=together), nominal.hypothesis)
        tangent = forward_jacobian(dataclasses.replace(nominal.hypothesis, problem=together), seen)
        allowed = np.array([parameter.size / parameter.tolerance if parameter.tolerance else 0.0
                            for parameter in nominal.hypothesis.free_parameters])
        fitted = sum(map(len, tangent.parts[:len(problem.fit) * problem.n]))
        follows = np.linalg.pinv(np.concatenate([tangent.slopes[:fitted], np.diag(allowed)]))
        known[nominal] = _Nominal(seen, tangent.slopes, allowed, follows[:, :fitted])
    return known[nominal]


def _changes(fit: Fit, j: int, sets: Sequence[Values]) -> np.ndarray:
    """Positions in log j with each set of values less those with the first, (sets, n, N)."""
    runs = np.concatenate([fit.hypothesis.means(j, sets[first:first + WIDE])
                           for first in range(0, len(sets), WIDE)])
    return np.nan_to_num(np.clip(runs - runs[0], -DIVERGED, DIVERGED), nan=DIVERGED)


def cause_shares(names: Sequence[str], taken: Mapping[frozenset[str], float],
                 ) -> dict[str, Share]:
    """Share of each of some causes, from what every set of them takes.

    Parameters
    ----------
    names : sequence of str
        The causes.
    taken : mapping
        Share of the gap by the set of causes, nothing by the empty one.

    """
    return {name: _share(name, names, taken) for name in names}


def _share(name: str, causes: Sequence[str], taken: Mapping[frozenset[str], float]) -> Share:
    everything, n = frozenset(causes), len(causes)
    mean = 0.0
    for before, of_others in taken.items():
        if name not in before:
            orders = math.factorial(len(before)) * math.factorial(n - len(before) - 1)
            mean += orders * (taken[before | {name}] - of_others)
    return Share(float(taken[frozenset({name})]),
                 float(taken[everything] - taken[everything - {name}]),
                 float(mean / math.factorial(n)))
