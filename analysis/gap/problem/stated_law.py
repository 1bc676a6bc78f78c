"""The law that a robot file states, and what the logs show of its state as they begin."""

from __future__ import annotations

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.block_of_file import law_of_file
from clie_blocks.analysis.gap.problem.drive_signals import with_drive_rest
from clie_blocks.analysis.gap.problem.initial_state import with_initial_speed, with_initial_state
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw, with_law_state
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.controller_section import MEASURED
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.robot_loop.links import Links


def stated_law(robot: Robot, period: float, pose: np.ndarray, links: Links,
               ratio: np.ndarray) -> StatedLaw:
    """Law of a controller; one that runs as a block is linearised at a pose [rad]."""
    controller = robot.controller
    if controller.is_block:
        return law_of_file(robot, period, pose, links, ratio)
    if controller.law not in ("pd", "cascade"):
        raise NotIdentifiableError(
            f"the control law is {controller.law!r}; the diagnosis replays laws of the kind 'pd', "
            "'pid' and 'cascade': state [controller] with its gains")
    return StatedLaw.of(control_law(controller, period), controller.u_is == MEASURED)


def with_start_state(log: Log, law: StatedLaw) -> Log:
    """Log with what its first samples show of the state in which robot and law began.

    A command that was not logged is that of the law.
    """
    if np.isnan(log.u).all():
        log = dataclasses.replace(log, u=law.commands(log))
    if isinstance(law, BlockLaw):
        return with_law_state(with_drive_rest(with_initial_speed(log, law.period), law), law)
    return with_initial_state(log, law)


def pose_of(robot: Robot, record: Record) -> np.ndarray:
    """Position about which a law is linearised: the stated set-point, or the mean [rad]."""
    for experiment in robot.experiments.values():
        if experiment.set_point is not None:
            return experiment.set_point
    return record.q.mean(axis=0)
