"""The prediction error of a model in closed loop, on the logs that validate it."""

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.unknown_states import responses_to_cuts


def validation_logs(problem: Problem) -> range:
    """Indices of the logs on which models are validated: those held out, or all."""
    return range(len(problem.fit) if problem.held_out else 0, len(problem.logs))


def gap(hypothesis: Hypothesis) -> float:
    """Sqrt of the sum over joints of the mean squared prediction error [rad]."""
    return rms([square_errors(hypothesis, j) for j in validation_logs(hypothesis.problem)])


def square_errors(hypothesis: Hypothesis, j: int) -> np.ndarray:
    """Squared error of log j, predicted from reference and excitation alone, over joints (N,).

    Where a log was cut, no model can know the state that it starts from: what that leaves is not
    counted.
    """
    problem, values = hypothesis.problem, hypothesis.of_log(j)
    log, error = problem.logs[j], hypothesis.error(j, dithered=False)
    for k in range(problem.n) if log.cuts else ():
        basis = responses_to_cuts(problem, values["inertia"], values["damping"], k, log)
        error[:, k] -= basis @ (basis.T @ error[:, k])
    return log.at_samples(np.sum(error**2, axis=1))


def rms(squares: list[np.ndarray]) -> float:
    """Root of the mean of all squares of some logs."""
    return float(np.sqrt(np.mean(np.concatenate(squares))))
