"""The diagnosis of one robot: its stages, in the order in which they run."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, cast

from threadpoolctl import threadpool_limits

from clie_blocks.analysis.gap.assessment.advice import advice
from clie_blocks.analysis.gap.assessment.formula import Formula
from clie_blocks.analysis.gap.assessment.gap_reduction import (
    GapReduction,
    bear_out_beyond_noise,
)
from clie_blocks.analysis.gap.assessment.result import Result
from clie_blocks.analysis.gap.backlash import to_stated_loop
from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.description import PARAMETRIC
from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.causes.vocabulary import excluded_names, select_causes
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import Explanation
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.law_view import law_view
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.counted_positions import with_positions_between_counts
from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.other_encoder import with_both_views
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.simulation.simulators import simulator_of
from clie_blocks.analysis.gap.simulator_comparison.difference import causes_missing_in
from clie_blocks.analysis.gap.stages import STAGES, Stages
from clie_blocks.analysis.gap.verdict.alike import likely_rivals, names_alike, numbers_alike
from clie_blocks.analysis.gap.verdict.joints_alike import at_other_joints
from clie_blocks.analysis.gap.verdict.posterior import (
    COMMANDS_UNCLEAR,
    LIKELY,
    MODEL_DIVERGED,
    NOT_BORNE_OUT,
    SET_PROBABILITY,
    UNKNOWN,
    RankedCause,
    certainty_of_unfinished,
    doubted,
    of_unfinished_search,
    posterior,
    unknown_for_none,
    verdict,
)
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding
from clie_blocks.analysis.gap.verdict.signal_findings import (
    controller_findings,
    may_be_all,
    signal_findings,
    with_signal_findings,
)
from clie_blocks.output import json_types

if TYPE_CHECKING:
    from control import InputOutputSystem
    from matplotlib.figure import Figure

    from clie_blocks.effects.effect import Setting


class Diagnosis(Result):
    """The result of a diagnosis: printed, as JSON, as a report, as plots."""

    def __str__(self) -> str:
        from clie_blocks.analysis.gap.report.answer import answer
        from clie_blocks.analysis.gap.report.summary import summary_lines

        return "\n".join(summary_lines(answer(self)))

    __repr__ = __str__

    def to_dict(self) -> dict[str, Any]:
        """Answer in plain JSON types: arrays as lists, what is not known as None."""
        from clie_blocks.analysis.gap.report.answer import answer

        return cast(dict[str, Any], json_types(answer(self)))

    def report(self, folder: str | PathLike[str], name: str = "diagnosis") -> list[str]:
        """Write the report as a page, with its JSON and the parameters for a simulator.

        Parameters
        ----------
        folder : path-like
            Folder to write to.
        name : str
            Name of the files, without ending.

        Returns
        -------
        list of str
            Paths of the files.

        """
        from clie_blocks.analysis.gap.report.answer import answer
        from clie_blocks.analysis.gap.report.files import write_report

        return write_report(self, answer(self), folder, name)

    def export(self, target: str, folder: str | PathLike[str],
               model: str | PathLike[str] | None = None) -> list[str]:
        """Put the correction into a simulator, as ``clie export`` does.

        Parameters
        ----------
        target : str
            One of `clie_blocks.analysis.export.export.TARGETS`, such as ``mujoco``.
        folder : path-like
            Folder to write to.
        model : path-like, optional
            The user's own model, which is patched; by default MuJoCo gets one of the stated links.

        Returns
        -------
        list of str
            Paths of the files.

        Raises
        ------
        ClieError
            If there is nothing to export, or the target cannot take it; says why.

        """
        from clie_blocks.analysis.export.correction import correction_of
        from clie_blocks.analysis.export.export import export

        found = export(correction_of(self.to_dict(), "the diagnosis"), target, model)
        return [str(path) for path in found.save(folder)]

    def plot(self, name: str) -> Figure:
        """Draw one figure of the report.

        Parameters
        ----------
        name : str
            ``motions``, ``probabilities``, ``where`` or ``residuals``.

        Raises
        ------
        ClieError
            For another name; names the nearest one.

        """
        from clie_blocks.analysis.gap.report.plots import figure

        return figure(self, name)

    def effects(self, log: int = 0) -> list[Setting]:
        """Return the causes of the corrected model, or a formula for them, and those of the law.

        Parameters
        ----------
        log : int
            The log, from 0, of what differs between logs, such as when a fault set in.

        Raises
        ------
        ClieError
            If no effect of the catalogue is the same as a cause.

        """
        from clie_blocks.analysis.gap.report.exports import law_settings, settings

        return (settings(self.with_formula.model, log)
                + law_settings(self.controller.named, self.problem.n))

    def corrected(self, plant: InputOutputSystem, log: int = 0) -> InputOutputSystem:
        """Return a plant, or a law, with its effects of those that were found.

        Parameters
        ----------
        plant : control.InputOutputSystem
            With the ports of eq. (8), or a law with the output u.
        log : int
            As in `effects`.

        Raises
        ------
        ClieError
            As in `effects`.

        """
        from clie_blocks.effects import with_effects
        from clie_blocks.effects.insertion import of_law

        is_law = all(label.startswith("u[") for label in plant.output_labels)
        return with_effects(plant, [one for one in self.effects(log)
                                    if one.effect.port != "log" and of_law(one) == is_law])


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices: threads would only wait
def diagnose(problem: Problem, method: Method = METHOD, effects: Sequence[str] = (),
             exclude: Sequence[str] = (), stages: Stages = STAGES,
             seconds: float = 120.0) -> Diagnosis:
    """Find the effects that make a robot differ from its model, where they act, and their share.

    Parameters
    ----------
    problem : Problem
        ``Problem.from_logs(robot, records)`` or ``Problem.from_loop(loop, records)``; with
        ``.beside(simulated)``, what differs between the robot and the user's own simulator.
    method : Method
        Thresholds.
    effects, exclude : sequence of str
        Effects to search for (all when empty), and effects to leave out.
    stages : Stages
        The functions that run.
    seconds : float
        Budget: the search ends early enough to answer within it, with what was fitted by then.

    """
    start = time.monotonic()
    deadline = start + _search_share(problem, method) * seconds
    causes, excluded = select_causes(effects, exclude), excluded_names(effects, exclude)
    problem = stages.read_set_points(problem, method, stages.steps)
    controller, causes = _within_reach(problem.law, stages.check_controller(problem), causes)
    simulator_of(problem, ()).check(problem.logs[0])
    controller = stages.read_commands(controller, problem, method, stages.steps)
    controller = stages.time_torque(controller, problem, method, stages.steps)
    corrected = controller.corrected(problem)
    if problem.simulated:
        corrected, decisions = stages.against_simulator(corrected, causes, method, stages.steps)
        controller = controller.with_decisions(decisions)
    causes = causes_missing_in(causes, corrected)

    def explained(read: Problem, causes: Sequence[Cause] = causes) -> Explanation:
        return stages.explain(with_both_views(with_observer(read, method)), causes, method,
                              stages.steps, deadline=deadline)

    corrected = _with_counts_read(corrected, controller, explained)
    controller, first = stages.time_torque_again(controller, problem, explained(corrected),
                                                 explained)
    if controller.torque_lag is not None:
        problem = dataclasses.replace(
            problem, corrections=(*problem.corrections, controller.torque_lag.correction))
    second = stages.explain_backlash(first, causes, method, stages.steps)
    of_law = controller_findings(controller, method.verdict, excluded)
    established = may_be_all(of_law, first.residuals.problem)
    is_another_law = controller.unknown_part or bool(controller.named and not established)
    ranking, model = _ranking(second or first, is_another_law, method, stages)
    alike = names_alike(ranking, (second or first).residuals, causes)
    numbers = _refined_numbers(ranking, second or first, stages)
    if second:
        ranking, model = to_stated_loop(ranking, model, first.residuals.problem)
    nominal = _stated_nominal(first, controller, problem, method, stages)
    reduction = stages.gap_reduction(nominal.hypothesis, model.hypothesis, first.residuals)
    earned = _earned(reduction, controller, first, ranking, model, stages)
    is_complete = first.is_complete and (second is None or second.is_complete)
    searched = 1.0 if is_complete else certainty_of_unfinished(
        ranking, (second or first).evidence.nominal_excess, method)
    ranking = of_unfinished_search(doubted(ranking, controller.reading * earned), searched)
    findings = _signal_findings(problem, first, controller, method, excluded)
    if _explains_motion_between_rows(ranking, first, method):
        findings = tuple(one for one in findings if one.effect != TIME_DELAY.name)
    decision = with_signal_findings(verdict(ranking, established, alike), (*findings, *of_law))
    is_nameless = decision == "unexplained" and ranking[0].names == (UNKNOWN,)
    mapped = first.nominal if is_nameless else model
    seen = law_view(first.nominal, first.residuals)
    return Diagnosis(
        problem, method, controller, first.residuals, first.nominal, (second or first).evidence,
        ranking, model, decision, reduction,
        torque_map=stages.torque_map(mapped.hypothesis.seen_by_law, seen.residuals),
        where=stages.localise(seen.residuals, seen.fit, controller),
        next_experiment=stages.next_experiment(seen.residuals, seen.fit, ranking),
        alike=alike, numbers_alike=numbers, findings=findings,
        advice=advice(first.residuals.problem, ranking),
        reason=_reason(decision, first, controller, earned), is_complete=is_complete,
        excluded=excluded, formula=_formula(decision, mapped, first, start + seconds, stages),
        seconds=time.monotonic() - start)


def _search_share(problem: Problem, method: Method) -> float:
    """Share of the budget after which the search ends."""
    search = method.search
    return search.long_budget_share if method.fitting.is_long(problem.n) else search.budget_share


def _with_counts_read(problem: Problem, controller: ControllerCheck,
                      explained: Callable[..., Explanation]) -> Problem:
    """Problem with positions between the counts of coarse encoders, where that leaves no gap.

    A joint that sticks within a count is not where a motion through its changes would be, so that
    beside other effects the counts are noise.
    """
    between = with_positions_between_counts(problem, controller.coarse, controller.step)
    return problem if between is problem or explained(between, ()).has_gap else between


def _within_reach(law: Law, controller: ControllerCheck, causes: Sequence[Cause],
                  ) -> tuple[ControllerCheck, tuple[Cause, ...]]:
    """Causes that can act in the loop; the decisions of the check name all others."""
    reached = tuple(cause for cause in causes if law.reaches(cause))
    unreachable = sorted({cause.name for cause in causes} - {cause.name for cause in reached})
    if unreachable:
        controller = controller.with_decisions(
            (f"{law.beyond_reach}: {', '.join(unreachable)}",))
    return controller, reached


def _ranking(explanation: Explanation, is_another_law: bool, method: Method,
             stages: Stages) -> tuple[list[RankedCause], Fit]:
    """Hypotheses by probability, and the leading model, without idle joints and near its prior.

    A law that neither the file states nor a name accounts for is something unknown.
    """
    ranking = posterior(explanation.evidence, method.calibration)
    if is_another_law:
        ranking = unknown_for_none(ranking)
    nominal, residuals = explanation.nominal, explanation.residuals
    leading = next((ranked.fit for ranked in ranking if ranked.fit is not None), nominal)
    if leading is nominal:
        return ranking, nominal
    model = stages.refine_to_prior(stages.prune_joints(leading, residuals, nominal.excess),
                                   residuals)
    return [dataclasses.replace(ranked, fit=model) if ranked.fit is leading else ranked
            for ranked in ranking], model


def _refined_numbers(ranking: Sequence[RankedCause], explanation: Explanation, stages: Stages,
                     ) -> tuple[Fit, ...]:
    """Models with other numbers of the file that move alike, refined as the leading one is.

    And those with the likeliest number at the joints of other links.
    """
    nominal, residuals = explanation.nominal, explanation.residuals
    others = tuple(stages.refine_to_prior(stages.prune_joints(rival, residuals, nominal.excess),
                                          residuals)
                   for rival in numbers_alike(ranking, explanation.evidence, residuals))
    leading = next((ranked.fit for ranked in (ranking[0], *likely_rivals(ranking))
                    if ranked.fit is not None and PARAMETRIC in ranked.names), None)
    return others if leading is None else (*others, *at_other_joints(leading, residuals))


def _earned(reduction: GapReduction, controller: ControllerCheck, first: Explanation,
            ranking: Sequence[RankedCause], model: Fit, stages: Stages) -> float:
    """Probability that unseen data bear the corrected model out, in the loop that ran.

    What the law that ran, or the counts of its encoder, explain is no merit of a cause of the
    robot.  Where the nominal model needs only parameters beyond their datasheet, or the cause
    explains no more of the fitted logs than these do, there is nothing to be borne out: a cause
    only keeps to the datasheet.  Where the gap does not show it either way, the whitened errors of
    held-out logs decide.
    """
    table, method = first.evidence, first.residuals.method
    beyond_datasheet = table.nominal_excess - table.prior_violation
    if model is first.nominal or beyond_datasheet < method.calibration.healthy:
        return 1.0
    left = next(ranked.excess for ranked in ranking if ranked.fit is not None)
    if 100.0 * (1.0 - left / beyond_datasheet) < method.assessment.earned_percent:
        return 1.0
    if controller.misdescribed or controller.coarse:
        reduction = stages.gap_reduction(first.nominal.hypothesis, model.hypothesis,
                                         first.residuals)
    shows_nothing = abs(reduction.percent or 0.0) < method.assessment.earned_percent
    if shows_nothing and bear_out_beyond_noise(first.nominal, model, method):
        return 1.0
    return reduction.earned


def _reason(decision: str, first: Explanation, controller: ControllerCheck, earned: float) -> str:
    """Why nothing explains the gap, where that is known."""
    if decision not in ("unexplained", "not_identifiable"):
        return ""
    if first.nominal.has_diverged:
        return MODEL_DIVERGED
    if earned < LIKELY:
        return NOT_BORNE_OUT
    return COMMANDS_UNCLEAR if controller.reading < SET_PROBABILITY else ""


def _formula(decision: str, model: Fit, first: Explanation, deadline: float, stages: Stages,
             ) -> Formula | None:
    """A formula for what a model of the stated robot leaves; None where that is noise."""
    problem = first.residuals.problem
    if decision == "none" or problem.simulated or problem.statement is None:
        return None
    seen = law_view(first.nominal, first.residuals)
    return stages.formula(model.hypothesis.seen_by_law,
                          dataclasses.replace(seen.residuals, deadline=deadline))


def _stated_nominal(first: Explanation, controller: ControllerCheck, problem: Problem,
                    method: Method, stages: Stages) -> Fit:
    """Nominal model in the stated loop and on the stated split of the logs.

    Models that follow recorded commands stay with them: the law that made these is not known.
    A stated loop that diverges says nothing of the robot.
    """
    if controller.recorded:
        return first.nominal
    if not (controller.misdescribed or controller.coarse):
        before = first.before_pooling
        return first.nominal if before is None or before.has_diverged else before
    stated = with_both_views(with_observer(problem, method))
    nominal = stages.steps.fit_nominal(stated, method, stages.steps.noise_model)[1]
    return first.nominal if nominal.has_diverged else nominal


def _explains_motion_between_rows(ranking: Sequence[RankedCause], first: Explanation,
                                  method: Method) -> bool:
    """Whether models that act between the rows of the logs need no delay to explain the motion.

    The path from set-point to motion, which knows a lag and dry friction, takes other lags for a
    delay.  Models that act once per row are late as it is, and cannot tell.
    """
    leading = ranking[0]
    acts_between = all(log.stride > 1 for log in first.residuals.problem.logs)
    return bool(acts_between and leading.names != (UNKNOWN,) and TIME_DELAY.name not in
                leading.names and leading.excess < method.calibration.healthy)


def _signal_findings(problem: Problem, first: Explanation, controller: ControllerCheck,
                     method: Method, excluded: frozenset[str]) -> tuple[SignalFinding, ...]:
    """What logged signals show without a model; a simulator's log holds the same signals."""
    if problem.simulated or not problem.law.is_replayable:
        return ()
    return signal_findings(problem.records, first.residuals, controller, excluded)
