"""The diagnosis of one robot: all stages in their order."""

import dataclasses
import time

from clie_blocks.analysis.gap.assessment.gap_reduction import gap_reduction
from clie_blocks.analysis.gap.assessment.localisation import localise
from clie_blocks.analysis.gap.assessment.next_experiment import next_experiment
from clie_blocks.analysis.gap.assessment.torque_map import torque_map
from clie_blocks.analysis.gap.backlash import explain_backlash, to_stated_loop
from clie_blocks.analysis.gap.causes.vocabulary import excluded_names, select_causes
from clie_blocks.analysis.gap.controller.replay import check_controller
from clie_blocks.analysis.gap.explain import explain
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import excess
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.observer import with_observer, without_observer
from clie_blocks.analysis.gap.fitting.refinement import prune_joints, refine_to_prior
from clie_blocks.analysis.gap.method.calibration import load_calibration
from clie_blocks.analysis.gap.problem.problem import problem as state_problem
from clie_blocks.analysis.gap.simulator_comparison.difference import (
    against_simulator,
    causes_missing_in,
)
from clie_blocks.analysis.gap.user_loop.checks import assumed_controller
from clie_blocks.analysis.gap.user_loop.problem import loop_problem
from clie_blocks.analysis.gap.verdict.posterior import posterior, unknown_for_none, verdict
from clie_blocks.analysis.gap.verdict.signal_findings import (
    established_names,
    signal_findings,
    with_signal_findings,
)


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
    model : Fit
        The corrected model: the leading hypothesis, or the best one where none leads.
    verdict : str
        ``effect``, ``parametric``, ``none``, ``unexplained`` or ``not_identifiable``.
    shrinkage : Shrinkage
        How far the gap shrinks on unseen data.
    repeatable : TorqueTable or None
        What the model leaves and every lap repeats, where that pays on unseen data.
    where : dict
        Where the gap lies, see `where`.
    next_experiment : dict or None
        The run that would tell the remaining causes apart.
    calibration : Calibration
        Numbers of the verdict.
    evidence : Table
        What the verdict rests on.
    seconds : float
        Time it took.
    paths : tuple of PathCause
        Causes that the way of the command shows by itself, see `paths`.
    left_out : frozenset of str
        Effects that were excluded, or not asked for: none of them is named.

    """

    problem: object
    check: object
    bench: object
    base: object
    ranking: list
    model: object
    verdict: str
    shrinkage: object
    repeatable: object
    where: dict
    next_experiment: dict | None
    calibration: object
    evidence: object
    seconds: float
    paths: tuple = ()
    left_out: frozenset = frozenset()


def diagnose(robot, records=None, held_out=None, calibration=None, effects=(), exclude=(),
             simulated=(), loop=None):
    """Say which effect makes a robot differ from its model, where, and how far the gap shrinks.

    Parameters
    ----------
    robot : Robot
        What is known of it; with `loop`, the record or list of records.
    records : list of Record
        Its logs.
    held_out : list of int, optional
        Logs that only judge; by default the last.
    calibration : Calibration, optional
        Numbers of the verdict.
    effects, exclude : sequence of str
        Effects to look for (all when empty), and effects to leave out.
    simulated : list of Record
        Logs of the user's own simulator in the same experiments; then the question is what
        differs between it and the robot.
    loop : control.NonlinearIOSystem, optional
        Any closed loop in the place of the paper's joint, see `loop_ports`.

    Returns
    -------
    Diagnosis
        The result of every stage.

    """
    began = time.perf_counter()
    causes, left_out = select_causes(effects, exclude), excluded_names(effects, exclude)
    calibration = calibration or load_calibration()
    if loop is None:
        asked = state_problem(robot, records, held_out)
        check = check_controller(asked)
    else:
        logs = list(robot) if isinstance(robot, (list, tuple)) else [robot]
        asked = loop_problem(loop, logs, held_out)
        check, causes = assumed_controller(asked, causes), tuple(filter(asked.law.reaches, causes))
    ran = check.mended(asked)
    if simulated:
        ran, decisions = against_simulator(ran, robot, simulated, causes, calibration)
        check = dataclasses.replace(check, decisions=check.decisions + decisions)
    causes = causes_missing_in(causes, ran.inside)
    bench, base, table = explain(with_observer(ran), causes)
    again = explain_backlash(bench.problem, table, causes, explain, calibration)
    ranking, model, table = _rank(again or (bench, base, table), check, calibration)
    if again:
        ranking, model = to_stated_loop(ranking, model, bench.problem)
    foreign = check.misdescribed or len(bench.problem.fit) > len(asked.fit)
    nominal = (fit_nominal(with_observer(asked))[1] if foreign else base).hypothesis
    paths = () if simulated or loop else signal_findings(records, bench, check, calibration, left_out)
    said = with_signal_findings(verdict(ranking, bool(established_names(check, left_out))), paths)
    believed = base if said == "unexplained" else model
    return Diagnosis(
        asked, check, bench, base, ranking, model, said,
        gap_reduction(without_observer(nominal, asked), without_observer(model.hypothesis, asked), bench),
        torque_map(believed.hypothesis, bench),
        localise(bench, base, check),
        next_experiment(bench, base, ranking, calibration), calibration, table,
        time.perf_counter() - began, paths, left_out)


def _rank(look, check, calibration):
    """Hypotheses by probability, the leading one freed from idle joints, and the evidence."""
    bench, base, table = look
    ranking = posterior(table, calibration)
    if check.gains or check.integral:
        ranking = unknown_for_none(ranking)
    model = _leading(ranking, base)
    if model is not base:
        home = refine_to_prior(prune_joints(model, bench, excess(base)), bench)
        ranking = [dataclasses.replace(s, fit=home) if s.fit is model else s for s in ranking]
        model = home
    return ranking, model, table


def _leading(ranking, base):
    """Fit of the leading hypothesis that has one: what is unknown has none."""
    return next((standing.fit for standing in ranking if standing.fit is not None), base)
