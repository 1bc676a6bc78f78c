"""The diagnosis of one robot: all stages in their order."""

import dataclasses
import time

import numpy as np

from clie_blocks.analysis.gap.baseline import baseline
from clie_blocks.analysis.gap.candidates import singles
from clie_blocks.analysis.gap.controller_check import controller_check
from clie_blocks.analysis.gap.fit import fit, judged
from clie_blocks.analysis.gap.hypothesis import hypothesis
from clie_blocks.analysis.gap.problem import problem as state_problem
from clie_blocks.analysis.gap.screen import screen
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
    """Fit the leading single causes, then add a second and a third cause while much is left."""
    found = screen(bench, base)
    leaders = singles(found, bench, base)[:LEADERS]
    fits = [polished(bench, base, candidate.members) for candidate in leaders]
    return fits


def polished(bench, base, members, iterations=8):
    """Fit members around a base; a start that is worse than the base is shrunk first."""
    start = hypothesis(bench.problem, members, base.hypothesis)
    return fit(start, bench, iterations)
