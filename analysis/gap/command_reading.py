"""Commands that no known law gives: whether they moved the robot, or the stated law did.

Where the law leaves part of the logged command, the logs are read in two ways.  If the command was
recorded as it acted, models that follow it leave less; if the law ran as stated and the column
holds something else, models under the law do.  The refitted nominal model tells which: by the odds
of the verdict, as it does of any two explanations.  Where it diverges in both, the stated law is
left out, and an observer leads the models, as on a machine of unknown law.

A logged command that is the law's but late, or times a number, is read in two ways as well: the
recorder wrote it so and the law's own command moved the robot, or the robot moved under what was
logged, since the drive is late or weak before the log has its command.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.controller.misrecorded import (
    OF_LOG,
    OF_ROBOT,
    is_doubtful,
    with_reading,
)
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import ExplainSteps
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.posterior import SET_PROBABILITY

FOLLOWED = "models follow the recorded command there, whatever made it"
OPEN_LOOP = ("a model under the stated law diverges, so that models follow the recorded commands "
             "beside an observer")
ALIKE = "the difference hardly moves the models, so that the stated law is kept"
NOT_FOLLOWED = "the stated law explains the motion better than the recorded command"


def read_commands(controller: ControllerCheck, problem: Problem, method: Method,
                  steps: ExplainSteps) -> ControllerCheck:
    """Return the check with the reading of the commands that leaves less, and its probability.

    It is the check itself where a known law gives the commands and nothing doubts the record.
    """
    controller = _read_record(controller, problem, method, steps)
    if not controller.unexplained:
        return controller
    calibration, followed = method.calibration, dataclasses.replace(
        controller, recorded=True, unknown_part=_has_unknown_part(controller, problem))
    readings = [followed, controller]
    fitted = [_fit_nominal(reading, problem, method, steps) for reading in readings]
    if all(nominal.has_diverged for _, nominal in fitted):
        return _with_decision(dataclasses.replace(followed, open_loop=True), problem, OPEN_LOOP)
    apart, excess = _apart(*fitted[0], fitted[1][1]), [fit.excess for _, fit in fitted]
    tolerated = calibration.healthy + calibration.misfit * max(excess)
    if apart < tolerated:
        return _with_decision(controller, problem, ALIKE)
    best = int(np.argmin(excess))
    chosen = dataclasses.replace(
        readings[best], reading=_probability(excess[best], excess[1 - best], apart, calibration))
    return _with_decision(chosen, problem, NOT_FOLLOWED if best else FOLLOWED)


def _read_record(controller: ControllerCheck, problem: Problem, method: Method,
                 steps: ExplainSteps) -> ControllerCheck:
    """Check with commands that are late or scaled read by what moved the robot.

    Where neither reading holds nine tenths of the probability, both are named as one answer.
    """
    if not is_doubtful(controller, problem):
        return controller
    readings = {place: with_reading(controller, problem, (place,))
                for place in (OF_LOG, OF_ROBOT)}
    excess = {place: _fit_nominal(one, problem, method, steps)[1].excess
              for place, one in readings.items()}
    score = {place: method.calibration.score(one, max(excess.values()))
             for place, one in excess.items()}
    likelier = max(score, key=lambda place: score[place])
    other = OF_LOG if likelier == OF_ROBOT else OF_ROBOT
    probability = 1.0 / (1.0 + np.exp(score[other] - score[likelier]))
    if probability >= SET_PROBABILITY:
        return readings[likelier]
    return with_reading(controller, problem, (likelier, other))


def _has_unknown_part(controller: ControllerCheck, problem: Problem) -> bool:
    """Whether commands hold more than their law though their excitation was logged.

    Without a logged excitation it may have been lost, and without the logged digits of a coarse
    position a part of the command is; neither says anything of the law.
    """
    return any(np.ptp(log.pe[:, k]) > 0.0 for log in problem.logs
               for k in set(controller.unexplained) - set(controller.coarse))


def _fit_nominal(reading: ControllerCheck, problem: Problem, method: Method,
                 steps: ExplainSteps) -> tuple[ResidualModel, Fit]:
    read = with_observer(reading.corrected(problem), method)
    return steps.fit_nominal(read, method, steps.noise_model)


def _with_decision(reading: ControllerCheck, problem: Problem, said: str) -> ControllerCheck:
    names = ", ".join(problem.joints[k] for k in reading.unexplained)
    return reading.with_decisions((f"{names}: no known law gives the logged command; {said}",))


def _probability(best: float, other: float, apart: float, calibration: Calibration) -> float:
    """Probability that the choice of a reading misleads no verdict.

    It misleads if it is the wrong one, by what the two leave, and if what lies between them
    would look like a rest that is not explained.
    """
    largest = max(best, other)
    unexplained = max(calibration.unexplained_share * largest, calibration.unexplained_least)

    def likelier(one: float, against: float) -> float:
        gain = calibration.score(one, largest) - calibration.score(against, largest)
        return float(1.0 / (1.0 + np.exp(-gain)))

    return 1.0 - likelier(other, best) * likelier(unexplained, apart)


def _apart(residuals: ResidualModel, one: Fit, other: Fit) -> float:
    """chi^2 between the motions of two models, per sample of one joint."""
    if one.has_diverged or other.has_diverged:
        return np.inf
    parts = [part for j in range(len(residuals.problem.logs)) for part in residuals.whitened(
        one.hypothesis.error(j) - other.hypothesis.error(j), j)]
    return float(np.mean(np.concatenate(parts) ** 2)) * residuals.problem.n
