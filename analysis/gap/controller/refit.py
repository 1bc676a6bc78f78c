"""What ran instead of the stated law, read from the log alone: gains, integral part, delay.

With position, reference and command logged, the law is linear in its gains: least squares finds
them without any model of the robot.  A finding counts only where it explains the command down to
its rounding, so that no fault of the robot is attributed to the controller.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples, law_residual
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem

DELAYED_COMMANDS = (
    "every command follows from the sample before it: the controller sends it one period after "
    "it has measured; the robot file is wrong, and the model has this delay from here on")


def with_fitted_gains(problem: Problem, law: StatedLaw, k: int) -> StatedLaw:
    """Return the law with the gains of joint k that fit the logged commands best.

    The velocity estimate of the law is kept.
    """
    columns, commands = [], []
    for log in problem.logs:
        usable = _within_limits(log, law, k)
        usable &= known_samples(log, law)
        terms = np.stack([log.q_d[:, k] - log.q[:, k], -law.rate(log.q)[:, k]], axis=1)
        columns.append(terms[usable])
        commands.append((log.u - log.pe)[usable, k])
    gains = np.linalg.lstsq(np.concatenate(columns), np.concatenate(commands), rcond=None)[0]
    kp, kd = law.kp.copy(), law.kd.copy()
    kp[k], kd[k] = gains
    return dataclasses.replace(law, kp=kp, kd=kd)


def describe_gains(name: str, stated: StatedLaw, fitted: StatedLaw, k: int) -> str:
    """Gains that ran at joint k, and the stated ones, as a sentence."""
    parts = [f"{key} {getattr(fitted, key)[k]:.4g}, stated {getattr(stated, key)[k]:.4g}"
             for key in ("kp", "kd")]
    return (f"{name}: the gains that ran are not the stated ones ({'; '.join(parts)}); the robot "
            "file is wrong, or somebody changed the controller")


def integral_gains(problem: Problem, law: StatedLaw) -> np.ndarray:
    """Integral gain of each joint that best explains the residual of the law, (n,) [N m/(rad s)].

    u = u_law + k_i T sum (q_d - q),   the sum begins with the log
    """
    gains = np.zeros(problem.n)
    for k in range(problem.n):
        integrals, residuals = [], []
        for log in problem.logs:
            usable = _within_limits(log, law, k)
            if log.measured is not None:
                usable &= known_samples(log, law)
            integrals.append(_error_integral(log, problem.period)[usable, k])
            residuals.append((log.u - law.replay(log.q, log.q_d, log.pe))[usable, k])
        column, residual = np.concatenate(integrals), np.concatenate(residuals)
        gains[k] = column @ residual / max(column @ column, np.finfo(float).tiny)
    return gains


def with_integral(problem: Problem, gains: np.ndarray) -> Problem:
    """Problem whose excitation contains an integral part with gains [N m/(rad s)], shape (n,).

    It is computed from the measured positions, from which the motion of a model differs by the
    gap alone.
    """
    return problem.with_logs(lambda log: dataclasses.replace(
        log, pe=log.pe + gains * _error_integral(log, problem.period)))


def describe_integral(name: str, gain: float) -> str:
    """Integral part that ran at a joint, as a sentence."""
    return (f"{name}: the command contains an integral part of {gain:.4g} N m/(rad s) that the "
            "robot file does not state; the file is wrong, or somebody changed the controller")


def delayed_replay_error(problem: Problem, law: StatedLaw) -> np.ndarray:
    """RMS of the logged command less that of the law one sample before it [N m], shape (n,)."""
    squares = [np.mean(law_residual(law, log, delay=1) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def with_command_delay(problem: Problem) -> Problem:
    """Problem whose commands stand at the sample in which they were computed, and act later.

    A command that is computed in one period and sent in the next is a matter of the controller's
    description, and no lag of the drive.
    """
    earlier = problem.with_logs(lambda log: dataclasses.replace(
        log, u=np.concatenate([log.u[1:], log.u[-1:]])))
    return dataclasses.replace(earlier, command_delay=problem.period)


def _within_limits(log: Log, law: StatedLaw, k: int) -> np.ndarray:
    """Samples in which the command of joint k is inside its limit."""
    return np.abs(log.u[:, k]) < law.saturation[k] * (1 - 1e-9)


def _error_integral(log: Log, period: float) -> np.ndarray:
    return period * np.cumsum(log.q_d - log.q, axis=0)
