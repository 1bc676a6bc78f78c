"""Signals of the drives that a law of the user's own reads: a velocity dq, and a torque tau.

A replay reads what was logged.  A model has no such sensors: it forms its velocity of its
positions, by the filter F(z) that comes nearest to the logged one (`measured_velocity`), and its
torque is the one that its drive gave in the sample before.  What that leaves of the logged ones,

    dq - F(z) q        and        tau_k - u_(k-1),

is known, and goes round the loop of each model as an error of its sensors.  So a model that moves
as the robot did gives the commands of the robot.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.log import Log, noise_above_motion
from clie_blocks.analysis.gap.problem.measured_velocity import velocity_beyond
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.robot_loop.sampled_law import VELOCITY, read_of_drive

INSTEAD = {"dq": "form the velocity within the law, from q, as the controller does",
           "tau": "form the torque within the law, from its own commands"}


def check_signals_of_law(robot: Robot, records: Sequence[Record]) -> None:
    """Refuse logs without a signal that the law reads of the drives.

    Raises
    ------
    NotIdentifiableError
        If a log lacks one; says what to log, or to do instead.

    """
    block = robot.controller.block
    for port in read_of_drive(block):
        for record in records:
            if getattr(record, port) is None:
                raise NotIdentifiableError(
                    f"{record.source}: the law {block.name!r} reads {port}[k], and the log has no "
                    f"{port}. Without it the commands of the law cannot be replayed: log it as "
                    f"the column {port}1 of the first joint and so on, or {INSTEAD[port]}")


def with_drive_rest(log: Log, law: Law) -> Log:
    """Log with what models do not form of the signals that their law reads of the drives."""
    if not isinstance(law, BlockLaw) or not law.block.reads:
        return log
    rest = np.hstack([_rest(port, log, law) for port in law.block.reads])
    dither = noise_above_motion(rest, law.period)
    return dataclasses.replace(log, drive_rest=rest - dither, drive_dither=dither)


def _rest(port: str, log: Log, law: BlockLaw) -> np.ndarray:
    """What of one signal models do not form, shape (N, n)."""
    if port == VELOCITY:
        speed = np.broadcast_to(log.speed, log.start.shape)
        return velocity_beyond((law.numerator[:, 0], law.denominator[:, 0]), log.law_q,
                               log.of_drive[port], speed, law.period)
    given = log.supplied_u
    return log.of_drive[port] - np.concatenate([0.0 * given[:1], given[:-1]])
