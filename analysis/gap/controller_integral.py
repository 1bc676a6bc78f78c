"""An integral part of the law that the file does not name, read from the log alone.

    u = u_law + k_i T sum (q_d - q),   the sum begins with the log

With position, reference and command logged it needs no model of the robot, and it counts only
where it explains the command down to its rounding.  The models that follow get it as excitation,
worked out from the measured positions: they part from these by the gap alone.
"""

import dataclasses

import numpy as np


def integral_gains(problem, law):
    """Integral gain of each joint that explains best what the law leaves [N m/(rad s)], (n,)."""
    gains = np.zeros(problem.n)
    for k in range(problem.n):
        sums, left = [], []
        for log in problem.logs:
            free = np.abs(log.u[:, k]) < law.saturation[k] * (1 - 1e-9)
            sums.append(_sum(log, problem.period)[free, k])
            left.append((log.u - law.replay(log.q, log.q_d, log.pe))[free, k])
        column, wanted = np.concatenate(sums), np.concatenate(left)
        gains[k] = column @ wanted / max(column @ column, np.finfo(float).tiny)
    return gains


def with_integral(problem, gains):
    """Problem whose excitation holds the integral part, worked out from the measured positions.

    Parameters
    ----------
    problem : Problem
        Logs.
    gains : ndarray, shape (n,)
        Integral gains [N m/(rad s)]; zero for joints without.

    """
    def logs(found):
        return tuple(dataclasses.replace(log, pe=log.pe + gains * _sum(log, problem.period))
                     for log in found)

    return dataclasses.replace(problem, fit=logs(problem.fit), held_out=logs(problem.held_out))


def in_words(name, gain):
    """Integral part that ran at a joint, as a sentence."""
    return (f"{name}: the command holds an integral part of {gain:.4g} N m/(rad s) that the file "
            "does not name; the file is wrong, or somebody changed the controller")


def _sum(log, period):
    return period * np.cumsum(log.q_d - log.q, axis=0)
