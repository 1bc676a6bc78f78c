"""How far the gap shrinks: prediction errors of nominal and corrected model on unseen data."""

import numpy as np


def validation_logs(problem):
    """Indices of the logs on which models are judged: those held out, or all."""
    first = len(problem.fit) if problem.held_out else 0
    return range(first, len(problem.logs))


def gap(hypothesis):
    """Sqrt of the sum over joints of the mean squared prediction error on the judging logs [rad].

    Parameters
    ----------
    hypothesis : Hypothesis
        The model, simulated in closed loop from the start angle.

    """
    return _rms([square_errors(hypothesis, j) for j in validation_logs(hypothesis.problem)])


def square_errors(hypothesis, j):
    """Squared error of log j, predicted from reference and excitation alone, over joints (N,)."""
    return np.sum(hypothesis.error(j, dithered=False) ** 2, axis=1)


def _rms(squares):
    return float(np.sqrt(np.mean(np.concatenate(squares))))
