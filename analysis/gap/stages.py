"""The stages of a diagnosis, each of which can be timed or swapped for another."""

import dataclasses
from collections.abc import Callable
from typing import Any

from clie_blocks.analysis.gap.assessment.formula import Formula, formula_of
from clie_blocks.analysis.gap.assessment.gap_reduction import GapReduction, gap_reduction
from clie_blocks.analysis.gap.assessment.localisation import localise
from clie_blocks.analysis.gap.assessment.next_experiment import NextExperiment, next_experiment
from clie_blocks.analysis.gap.assessment.torque_map import TorqueMap, torque_map
from clie_blocks.analysis.gap.backlash import explain_backlash
from clie_blocks.analysis.gap.command_reading import read_commands
from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import EXPLAIN_STEPS, ExplainSteps, Explanation, explain
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.refinement import prune_joints, refine_to_prior
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.set_point_reading import read_set_points
from clie_blocks.analysis.gap.simulator_comparison.difference import against_simulator
from clie_blocks.analysis.gap.torque_timing import time_torque, time_torque_again
from clie_blocks.output import report_stage


@dataclasses.dataclass(frozen=True)
class Stages:
    """The functions that a diagnosis is made of: each can be timed, or swapped for another.

    An ablation is ``dataclasses.replace(STAGES, next_experiment=lambda *_: None)``.
    """

    read_set_points: Callable[..., Problem] = read_set_points
    check_controller: Callable[[Problem], ControllerCheck] = check_controller
    read_commands: Callable[..., ControllerCheck] = read_commands
    time_torque: Callable[..., ControllerCheck] = time_torque
    time_torque_again: Callable[..., tuple[ControllerCheck, Explanation]] = time_torque_again
    against_simulator: Callable[..., tuple[Problem, tuple[str, ...]]] = against_simulator
    explain: Callable[..., Explanation] = explain
    explain_backlash: Callable[..., Explanation | None] = explain_backlash
    prune_joints: Callable[..., Fit] = prune_joints
    refine_to_prior: Callable[..., Fit] = refine_to_prior
    gap_reduction: Callable[..., GapReduction] = gap_reduction
    torque_map: Callable[..., TorqueMap | None] = torque_map
    formula: Callable[..., Formula | None] = formula_of
    localise: Callable[..., dict[str, Any]] = localise
    next_experiment: Callable[..., NextExperiment | None] = next_experiment
    steps: ExplainSteps = EXPLAIN_STEPS


STAGES = Stages()
TITLES = {"read_set_points": "reading the set-points",
          "check_controller": "replaying the control law", "read_commands": "reading the commands",
          "time_torque": "timing the measured torque",
          "against_simulator": "comparing with the simulator", "explain": "searching for causes",
          "explain_backlash": "checking for backlash", "prune_joints": "refining the model",
          "gap_reduction": "predicting unseen data", "torque_map": "looking for a torque map",
          "formula": "looking for a formula",
          "localise": "locating the gap", "next_experiment": "planning the next experiment"}


def with_titles(stages: Stages) -> Stages:
    """Return the same stages, each of which names itself in the progress as it begins."""
    def naming(name: str, title: str) -> Callable[..., Any]:
        stage = getattr(stages, name)

        def run(*args: Any, **options: Any) -> Any:
            report_stage(title)
            return stage(*args, **options)

        return run

    spoken: dict[str, Any] = {name: naming(name, title) for name, title in TITLES.items()}
    return dataclasses.replace(stages, **spoken)
