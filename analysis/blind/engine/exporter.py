"""What an exporter writes into the command column of a log; the robot never feels it."""

import numpy as np

from clie_blocks.analysis.blind.engine.parameters import Parameters


def logged_command(u: np.ndarray, period: float, p: Parameters) -> np.ndarray:
    """Command as logged [N m]: older than its row, and scaled.

    Parameters
    ----------
    u : ndarray, shape (N, n)
        Command of each sample, held until the next one [N m].
    period : float
        Time between rows [s].
    p : dict of ndarray, shape (n,)
        True parameters: ``skew`` [s] and ``logged_gain``.

    """
    rows = np.arange(len(u))[:, None] - np.ceil(p["skew"] / period - 1e-9).astype(int)
    return p["logged_gain"] * np.take_along_axis(u, np.maximum(rows, 0), axis=0)
