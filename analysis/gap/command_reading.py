"""Commands that no known law gives: whether they moved the robot, or the stated law did.

Where the law leaves part of the logged command, the logs are read in two ways.  If the command was
recorded as it acted, models that follow it leave less; if the law ran as stated and the column
holds something else, models under the law do.  The refitted nominal model tells which: by the odds
of the verdict, as it does of any two explanations.  Where it diverges in both, the stated law is
left out, and an observer leads the models, as on a machine of unknown law.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import ExplainSteps
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

FOLLOWED = "models follow the recorded command there, whatever made it"
OPEN_LOOP = ("a model under the stated law diverges, so that models follow the recorded commands "
             "beside an observer")
ALIKE = "the difference hardly moves the models, so that the stated law is kept"
NOT_FOLLOWED = "the stated law explains the motion better than the recorded command"


def read_commands(controller: ControllerCheck, problem: Problem, method: Method,
                  steps: ExplainSteps) -> ControllerCheck:
    """Return the check with the reading of the commands that leaves less, and its probability.

    It is the check itself where a known law gives the commands.
    """
    if not controller.unexplained:
        return controller
    followed = dataclasses.replace(controller, recorded=True)
    readings = [followed, controller]
    fitted = [_fit_nominal(reading, problem, method, steps) for reading in readings]
    if all(nominal.has_diverged for _, nominal in fitted):
        return _with_decision(dataclasses.replace(followed, open_loop=True), problem, OPEN_LOOP)
    if _are_alike(*fitted[0], fitted[1][1], method):
        return _with_decision(controller, problem, ALIKE)
    excess = np.array([nominal.excess for _, nominal in fitted])
    best = int(np.argmin(excess))
    chosen = dataclasses.replace(readings[best], reading=_probability(excess, best, method))
    return _with_decision(chosen, problem, NOT_FOLLOWED if best else FOLLOWED)


def _fit_nominal(reading: ControllerCheck, problem: Problem, method: Method,
                 steps: ExplainSteps) -> tuple[ResidualModel, Fit]:
    read = with_observer(reading.corrected(problem), method)
    return steps.fit_nominal(read, method, steps.noise_model)


def _with_decision(reading: ControllerCheck, problem: Problem, said: str) -> ControllerCheck:
    names = ", ".join(problem.joints[k] for k in reading.unexplained)
    return reading.with_decisions((f"{names}: no known law gives the logged command; {said}",))


def _probability(excess: np.ndarray, best: int, method: Method) -> float:
    """Probability of the better of two readings, by what they leave."""
    largest = float(excess.max())
    scores = [method.calibration.score(float(left), largest) for left in excess]
    return float(1.0 / (1.0 + np.exp(scores[1 - best] - scores[best])))


def _are_alike(residuals: ResidualModel, one: Fit, other: Fit, method: Method) -> bool:
    """Whether two readings predict the same motion, down to what a right model may leave."""
    if one.has_diverged or other.has_diverged:
        return False
    apart = [part for j in range(len(residuals.problem.logs)) for part in residuals.whitened(
        one.hypothesis.error(j) - other.hypothesis.error(j), j)]
    difference = float(np.mean(np.concatenate(apart) ** 2)) * residuals.problem.n
    calibration = method.calibration
    return difference < calibration.healthy + calibration.misfit * max(one.excess, 0.0)
