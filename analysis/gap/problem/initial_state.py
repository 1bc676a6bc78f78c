"""Logs that begin while the robot moves: its velocity at the first sample.

With the first command logged, the velocity that the law had formed at the first sample is known to
the rounding of the command.  It is zero where controller and robot begin at rest.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log

FIRST_SECONDS = 0.1  # s at the beginning of a log, in which a cubic is fitted to the position
FEWEST = 5  # samples to which a parabola is fitted
SLOPE_VARIANCE = 192.0  # of a parabola's slope at its end, by noise^2 / (samples^3 period^2)
LEAST_INITIAL_SPEED = 0.05  # of the largest speed of a log; slower logs begin at rest


def with_initial_state(log: Log, law: StatedLaw) -> Log:
    """Return the log with the start and velocity of its first sample, itself if it is at rest."""
    rows = max(4, round(FIRST_SECONDS / law.period))
    if len(log) < 2 * rows:
        return log
    largest = np.abs(log.q[rows:] - log.q[:-rows]).max(axis=0) / (rows * law.period)
    least = LEAST_INITIAL_SPEED * largest
    speed = np.polyfit(law.period * np.arange(rows), log.q[:rows], 3)[-2]
    moving = (np.abs(speed) > least) & (np.abs(initial_filtered_velocity(log, law)) > least)
    if not moving.any():
        return log
    return dataclasses.replace(log, start=log.q[0], speed=speed, at_rest=False)


def with_initial_speed(log: Log, period: float) -> Log:
    """Return the log with the start and velocity of its first sample, under any law.

    The velocity is the slope there of a parabola over as few samples as the noise allows: a robot
    that begins at rest may be fast after a tenth of a second.
    """
    rows = max(4, round(FIRST_SECONDS / period))
    if len(log) < 2 * rows:
        return log
    largest = np.abs(log.q[rows:] - log.q[:-rows]).max(axis=0) / (rows * period)
    speed = np.zeros(log.q.shape[1])
    for k in np.flatnonzero(largest):
        allowed = LEAST_INITIAL_SPEED / 3 * largest[k] * period
        count = (SLOPE_VARIANCE * (np.std(log.dither[:, k]) / allowed) ** 2) ** (1 / 3)
        few = int(np.clip(np.ceil(count), FEWEST, rows))
        speed[k] = np.polyfit(period * np.arange(few), log.q[:few, k], 2)[-2]
    if not (np.abs(speed) > LEAST_INITIAL_SPEED * largest).any():
        return log
    return dataclasses.replace(log, start=log.q[0], speed=speed, at_rest=False)


def initial_filtered_velocity(log: Log, law: StatedLaw) -> np.ndarray:
    """Velocity that the law had formed at the first sample [rad/s]; 0 where it needs none."""
    kd = np.where(law.kd > 0, law.kd, 1.0)
    damping_torque = law.kp * (log.q_d[0] - log.q[0]) + log.pe[0] - log.u[0]
    within_limit = np.abs(log.u[0]) < law.saturation * (1 - 1e-9)
    return np.where((law.kd > 0) & within_limit, damping_torque / kd, 0.0)
