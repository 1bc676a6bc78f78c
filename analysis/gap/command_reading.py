"""Commands that no known law gives: whether they moved the robot, or the stated law did.

Where the law leaves part of the logged command, the logs are read in two ways.  If the command was
recorded as it acted, models that follow it leave less; if the law ran as stated and the column
holds something else, models under the law do.  The refitted nominal model tells which: by the odds
of the verdict, as it does of any two explanations.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import ExplainSteps
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

FOLLOWED = "models follow the recorded command there, whatever made it"
NOT_FOLLOWED = "the stated law explains the motion better than the recorded command"


def read_commands(controller: ControllerCheck, problem: Problem, method: Method,
                  steps: ExplainSteps) -> ControllerCheck:
    """Return the check with the reading of the commands that leaves less, and its probability.

    It is the check itself where a known law gives the commands.
    """
    if not controller.unexplained:
        return controller
    readings = [dataclasses.replace(controller, recorded=recorded) for recorded in (True, False)]
    fitted = [steps.fit_nominal(reading.corrected(problem), method, steps.noise_model)
              for reading in readings]
    excess = np.array([nominal.excess for _, nominal in fitted])
    best = int(np.argmin(excess))
    probability = _probability(excess, best, method)
    if _are_alike(*fitted[best], fitted[1 - best][1], method):
        probability = 1.0
    names = [problem.joints[k] for k in controller.unexplained]
    said = (f"{', '.join(names)}: no known law gives the logged command; "
            f"{NOT_FOLLOWED if best else FOLLOWED}")
    return dataclasses.replace(readings[best], reading=probability).with_decisions((said,))


def _probability(excess: np.ndarray, best: int, method: Method) -> float:
    """Probability of the better of two readings, by what they leave."""
    largest = float(excess.max())
    scores = [method.calibration.score(float(left), largest) for left in excess]
    return float(1.0 / (1.0 + np.exp(scores[1 - best] - scores[best])))


def _are_alike(residuals: ResidualModel, best: Fit, other: Fit, method: Method) -> bool:
    """Whether both readings predict the same motion, down to what a healthy robot leaves."""
    if best.has_diverged or other.has_diverged:
        return False
    apart = [part for j in range(len(residuals.problem.logs)) for part in residuals.whitened(
        best.hypothesis.error(j) - other.hypothesis.error(j), j)]
    squares = np.concatenate(apart) ** 2
    return bool(np.mean(squares) * residuals.problem.n < method.calibration.healthy)
