"""What the column u of a log is: a command, a torque that was measured, or one computed later.

A torque behind the drive says nothing of the drive and everything of the joint, so that no law is
needed: it drives the models.  A torque that was computed from the other columns says nothing.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import COMPUTED, MEASURED, Controller

LAW_LEFT_OUT = ("u is a torque that was measured behind the drive: it moved the joints whatever "
                "law asked for it, so that the law is left out, and nothing that a drive does to "
                "a command can show.")
LAW_TOO_FAST = ("The loop of the law is faster than these logs have samples: the recorded command "
                "drives the models beside an observer, and the law is left out.")
COMPUTED_U = "u was computed from the other columns: it is no measurement, and is not read."
UNSIGNED = "The measured torque never changes its sign and is not read."


def as_u_is(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Robot and records by what the column u holds.

    A torque that was measured behind the drive moved the joints whatever law asked for it; the law
    is left out.  A torque that was computed from the other columns says nothing that they do not.
    """
    law, logs = robot.controller, list(records)
    if law.u_is == COMPUTED and (law.law != "unknown" or all(log.qd is not None for log in logs)):
        return robot, [log.replace(u=None).noted(COMPUTED_U) for log in logs]
    stands_in = law.u_is is None and all(
        log.u is not None and log.tau is not None and np.array_equal(log.u, log.tau, True)
        for log in logs)
    if law.u_is != MEASURED and not stands_in:
        return robot, logs
    if law.law == "unknown":
        return dataclasses.replace(robot, controller=dataclasses.replace(law, u_is=MEASURED)), logs
    return without_law(robot, logs, MEASURED, LAW_LEFT_OUT)


def without_law(robot: Robot, records: Sequence[Record], u_is: str, why: str,
                ) -> tuple[Robot, list[Record]]:
    """Robot and records whose recorded torques drive the models, whatever law ran."""
    sample_time = robot.controller.sample_time if u_is == MEASURED else None
    gravity = bool(robot.nominal.gravity) if robot.tree is None else robot.nominal.gravity
    robot = dataclasses.replace(
        robot, controller=Controller(law="unknown", sample_time=sample_time, u_is=u_is),
        nominal=dataclasses.replace(robot.nominal, gravity=gravity))
    return robot, [record.replace(robot=robot).noted(why) for record in records]


def has_sign(records: Sequence[Record]) -> bool:
    """Whether the measured torques of all joints that move act both ways.

    A current that is logged without its sign cannot drive a model.
    """
    if any(record.tau is None for record in records):
        return False
    tau = np.concatenate([record.signal("tau") for record in records])
    moving = np.concatenate([np.ptp(record.q, axis=0)[None] for record in records]).max(axis=0) > 0
    both_ways = (np.nanmin(tau, axis=0) < 0.0) & (np.nanmax(tau, axis=0) > 0.0)
    return bool(moving.any() and both_ways[moving].all())
