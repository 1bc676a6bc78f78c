"""Gains and timing that ran in the place of the stated ones, read from the log alone.

With position, reference and command logged, the law is linear in its gains: least squares finds
them without any model of the robot.  A finding counts only where it explains the command down to
its rounding, so that nothing of the robot can pose as the controller.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.controller.law_residual import first_known_sample, law_residual
from clie_blocks.analysis.gap.fitting.hypothesis import Member


def with_fitted_gains(problem, law, k):
    """Return the law with the gains of joint k that fit the logged commands best.

    Parameters
    ----------
    problem : Problem
        Logs.
    law : ControlLaw
        The law to mend; its velocity estimate is kept.
    k : int
        Joint.

    """
    columns, wanted = [], []
    for log in problem.logs:
        free = np.abs(log.u[:, k]) < law.saturation[k] * (1 - 1e-9)
        free[:first_known_sample(log, law)] = False
        columns.append(np.stack([log.q_d[:, k] - log.q[:, k], -law.rate(log.q)[:, k]], 1)[free])
        wanted.append((log.u - log.pe)[free, k])
    found = np.linalg.lstsq(np.concatenate(columns), np.concatenate(wanted), rcond=None)[0]
    kp, kd = law.kp.copy(), law.kd.copy()
    kp[k], kd[k] = found
    return dataclasses.replace(law, kp=kp, kd=kd)


def describe_gains(name, stated, ran, k):
    """Gains that ran at joint k beside the stated ones, as a sentence."""
    parts = [f"{key} {getattr(ran, key)[k]:.4g}, stated {getattr(stated, key)[k]:.4g}"
             for key in ("kp", "kd")]
    return (f"{name}: the gains that ran are not the stated ones ({'; '.join(parts)}); the file "
            "is wrong, or somebody changed the controller")


def integral_gains(problem, law):
    """Integral gain of each joint that explains best what the law leaves [N m/(rad s)], (n,)."""
    gains = np.zeros(problem.n)
    for k in range(problem.n):
        sums, left = [], []
        for log in problem.logs:
            free = np.abs(log.u[:, k]) < law.saturation[k] * (1 - 1e-9)
            sums.append(_error_integral(log, problem.period)[free, k])
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
        return tuple(dataclasses.replace(log, pe=log.pe + gains * _error_integral(log, problem.period))
                     for log in found)

    return dataclasses.replace(problem, fit=logs(problem.fit), held_out=logs(problem.held_out))


def describe_integral(name, gain):
    """Integral part that ran at a joint, as a sentence."""
    return (f"{name}: the command holds an integral part of {gain:.4g} N m/(rad s) that the file "
            "does not name; the file is wrong, or somebody changed the controller")


def _error_integral(log, period):
    return period * np.cumsum(log.q_d - log.q, axis=0)


SURE = 0.02  # of the period: how well its length is known
LATE_COMMANDS = ("every command follows from the row before it: the controller sends it one period after "
         "it has measured; the file is wrong, and the model has this delay from here on")


def delayed_replay_error(problem, law):
    """RMS of the logged command less that of the law in the row before it, shape (n,)."""
    squares = [np.mean(law_residual(law, log, late=1) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def with_command_delay(problem):
    """Problem whose commands stand where they were worked out, with the delay that this leaves.

    Parameters
    ----------
    problem : Problem
        Logs with late commands.

    """
    def logs(found):
        return tuple(dataclasses.replace(log, u=np.concatenate([log.u[1:], log.u[-1:]]))
                     for log in found)

    period = np.full(problem.n, problem.period)
    delay = Member(TIME_DELAY, tuple(range(problem.n)), {"time": period},
                   {"time": SURE * period})
    return dataclasses.replace(problem, fit=logs(problem.fit), held_out=logs(problem.held_out),
                               inside=(*problem.inside, delay))
