"""How large the gap is: RMS of the closed-loop prediction error on logs not used for fitting."""

import numpy as np


def gap(hypothesis, logs=None):
    """sqrt of the sum over joints of the mean squared prediction error [rad].

    Parameters
    ----------
    hypothesis : Hypothesis
        The model.
    logs : list of int, optional
        Indices; by default the logs held out, or all when none is.

    """
    problem = hypothesis.problem
    first = len(problem.fit) if problem.held_out else 0
    logs = range(first, len(problem.logs)) if logs is None else logs
    squares = [np.sum(np.mean(hypothesis.error(j) ** 2, axis=0)) for j in logs]
    return float(np.sqrt(np.mean(squares)))
