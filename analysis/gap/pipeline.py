"""The diagnosis of one robot: all stages in their order."""

import dataclasses
import time

from clie_blocks.analysis.gap.baseline import baseline
from clie_blocks.analysis.gap.candidates import extended, pairs, singles
from clie_blocks.analysis.gap.controller_check import controller_check
from clie_blocks.analysis.gap.fit import fit
from clie_blocks.analysis.gap.hypothesis import hypothesis
from clie_blocks.analysis.gap.problem import problem as state_problem
from clie_blocks.analysis.gap.screen import rescreened, screen
from clie_blocks.analysis.gap.verdict import Calibration, excess, standings

LEADERS = 8
ENOUGH = 0.4  # excess per sample below which no second cause is looked for


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis:
    """All that was found, stage by stage.

    Parameters
    ----------
    problem : Problem
        What was asked.
    check : ControllerCheck
        Whether the stated controller ran.
    bench : Bench
        Noise and whitening.
    base : Fit
        The refitted nominal model.
    ranking : list of Standing
        Hypotheses, most probable first.
    calibration : Calibration
        Numbers of the verdict.
    seconds : float
        Time it took.

    """

    problem: object
    check: object
    bench: object
    base: object
    ranking: list
    calibration: object
    seconds: float


def diagnose(robot, records, held_out=None, calibration=None):
    """Say which effect makes a robot differ from its model.

    Parameters
    ----------
    robot : Robot
        What is known of it.
    records : list of Record
        Its logs.
    held_out : list of int, optional
        Logs that only judge; by default the last.
    calibration : Calibration, optional
        Numbers of the verdict.

    Returns
    -------
    Diagnosis
        The result of every stage.

    """
    began = time.perf_counter()
    calibration = calibration or Calibration()
    asked = state_problem(robot, records, held_out)
    check = controller_check(asked)
    problem = dataclasses.replace(asked, law=check.law)
    bench, base = baseline(problem)
    fits = []
    if excess(base) > 0.1 or base.penalty > 4.0:
        fits = explore(bench, base)
    ranking = standings(base, fits, calibration)
    return Diagnosis(asked, check, bench, base, ranking, calibration,
                     time.perf_counter() - began)


def explore(bench, base):
    """Fit the leading single causes, then pairs and triples while much is left.

    Parameters
    ----------
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.

    Returns
    -------
    list of Fit
        All hypotheses that were fitted.

    """
    found = screen(bench, base)
    fits = race(bench, base, singles(found, bench, base)[:LEADERS], LEADERS // 2)
    if _enough(fits):
        return fits
    chosen = pairs(found)[:LEADERS // 2]
    for first in sorted(fits, key=lambda f: f.total)[:3]:
        left = rescreened(found, bench, first)
        chosen += list(extended(first, singles(left, bench, first)[:6]))[:3]
    fits += race(bench, base, _distinct(chosen), 3)
    if _enough(fits):
        return fits
    best = min(fits, key=lambda f: f.total)
    left = rescreened(found, bench, best)
    chosen = list(extended(best, singles(left, bench, best)[:6]))[:3]
    return fits + race(bench, base, chosen, 1)


def race(bench, base, candidates, finalists):
    """Fit candidates for a few steps, then the best of them to the end."""
    started = [fit(_start(bench, base, candidate.members), bench, 2) for candidate in candidates]
    order = sorted(started, key=lambda f: f.total)
    return [fit(f.hypothesis, bench, 8) for f in order[:finalists]] + order[finalists:]


def _start(bench, base, members):
    fitted = {}
    start = hypothesis(bench.problem, members, base.hypothesis)
    fitted.update(start.values)
    return start.with_values(fitted)


def _enough(fits):
    return min(excess(f) for f in fits) < ENOUGH


def _distinct(candidates):
    seen = {}
    for candidate in candidates:
        key = frozenset(member.cause.key for member in candidate.members)
        seen.setdefault(key, candidate)
    return list(seen.values())
