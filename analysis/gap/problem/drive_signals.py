"""Signals of the drives that a law of the user's own reads: a velocity dq, and a torque tau.

A replay reads what was logged.  A model has no such sensors.  It forms its velocity of its
positions q, by the filter F(z) that comes nearest to the logged one (`measured_velocity`), and its
torque of its commands u, by its drive D, whatever effects that has, one sample later:

    dq = F q + (dq - F q)_log,        tau = D u / z + (tau - D u / z)_log.

What is in brackets is known of the log.  So a model that moves as the robot did reads what the
robot read, and gives its commands, wherever the sensors of the drive sit and whatever they add.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.log import NOISE_CORNER, Log
from clie_blocks.analysis.gap.problem.measured_velocity import velocity_beyond
from clie_blocks.analysis.gap.problem.noise_above_motion import noise_above_motion
from clie_blocks.analysis.gap.problem.own_law import BlockLaw
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.robot_loop.sampled_law import TORQUE, VELOCITY, read_of_drive

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
    if block is None:
        return
    for port in read_of_drive(block):
        for record in records:
            if getattr(record, port) is None:
                raise NotIdentifiableError(
                    f"{record.source}: the law {block.name!r} reads {port}[k], and the log has no "
                    f"{port}. Without it the commands of the law cannot be replayed: log it as "
                    f"the column {port}1 of the first joint and so on, or {INSTEAD[port]}")
            if port == TORQUE and record.units[TORQUE] != record.units["u"]:
                raise NotIdentifiableError(
                    f"{record.source}: the law {block.name!r} reads tau[k], which is logged in "
                    f"{record.units[TORQUE][0]}, and its commands u are in "
                    f"{record.units['u'][0]}; models make the one of the other: log both in one "
                    "unit, on one side of the gear, and let the law read it so")


def with_drive_rest(log: Log, law: Law) -> Log:
    """Log with what models do not form of the signals that their law reads of the drives."""
    if not isinstance(law, BlockLaw) or not law.block.reads:
        return log
    rest, dither = [], []
    if VELOCITY in law.block.reads:
        speed = np.broadcast_to(log.speed, log.start.shape)
        beyond = velocity_beyond((law.numerator[:, 0], law.denominator[:, 0]), log.law_q,
                                 log.of_drive[VELOCITY], speed, law.period)
        dither.append(noise_above_motion(beyond, NOISE_CORNER, 1.0 / law.period))
        rest.append(beyond - dither[0])
    if TORQUE in law.block.reads:  # the drive of the model takes the recorded command
        rest += [log.of_drive[TORQUE], log.supplied_u]
        dither += [np.zeros_like(log.u)] * 2
    return dataclasses.replace(log, drive_rest=np.hstack(rest), drive_dither=np.hstack(dither))
