"""Logs that begin while the robot moves: how fast, and what the law already remembers.

The law tells: with the first command logged, its velocity at the first sample is known to the
rounding of the command, and it is zero where controller and robot begin at rest.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log

GLANCE = 0.1  # s at the beginning of a log, over which a cubic reads its speed
MOVING = 0.05  # of the largest speed of a log, from which it does not begin at rest


def with_initial_state(log: Log, law: StatedLaw) -> Log:
    """Return the log as it is, or with the start that it was cut at."""
    rows = max(4, round(GLANCE / law.period))
    if len(log) < 2 * rows:
        return log
    least = MOVING * np.abs(log.q[rows:] - log.q[:-rows]).max(axis=0) / (rows * law.period)
    speed = np.polyfit(law.period * np.arange(rows), log.q[:rows], 3)[-2]
    moving = (np.abs(speed) > least) & (np.abs(initial_filtered_velocity(log, law)) > least)
    if not moving.any():
        return log
    return dataclasses.replace(log, start=log.q[0], speed=speed, at_rest=False)


def initial_filtered_velocity(log: Log, law: StatedLaw) -> np.ndarray:
    """Velocity that the law had formed at the first sample [rad/s]; 0 where it needs none."""
    kd = np.where(law.kd > 0, law.kd, 1.0)
    left = law.kp * (log.q_d[0] - log.q[0]) + log.pe[0] - log.u[0]
    free = np.abs(log.u[0]) < law.saturation * (1 - 1e-9)
    return np.where((law.kd > 0) & free, left / kd, 0.0)
