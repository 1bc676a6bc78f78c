"""Logs of a robot whose motors turn several joints: positions of its motors in their place.

Drives, their law and their friction act motor by motor.  In the positions of the motors over their
gear ratios a coupled robot is like any other, and only its links feel the coupling.
"""

import dataclasses

from clie_blocks.analysis.records.fields import FixedDict
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Experiment
from clie_blocks.rigid_body.motor_coupling import inverse_of, mapped

NOTE = ("Motors are coupled: positions are those of the motors over their gear ratios, C^-1 q, "
        "and the name of a joint stands for its drive.")


def with_motor_positions(record: Record, robot: Robot | None) -> Record:
    """Record of a robot whose positions are those of the motors, where they are coupled."""
    if robot is None or robot.motor_coupling is None:
        return record
    if robot.encoder.positions == "motors":
        return record.noted(NOTE.replace(", C^-1 q", ", as logged"))
    inverse = inverse_of(robot.motor_coupling)
    changes = {name: mapped(inverse, record.signal(name)) for name in ("q", "qd", "dq")
               if name in record.signals}
    return record.replace(**changes).noted(NOTE)


def with_motor_experiments(robot: Robot) -> Robot:
    """Robot whose experiments begin at positions of the motors, where they are coupled."""
    if robot.motor_coupling is None or robot.encoder.positions == "motors":
        return robot
    inverse = inverse_of(robot.motor_coupling)

    def moved(experiment: Experiment) -> Experiment:
        start, centre = (None if place is None else mapped(inverse, place)
                         for place in (experiment.start, experiment.set_point))
        return dataclasses.replace(experiment, start=start, set_point=centre)

    return dataclasses.replace(robot, experiments=FixedDict(
        {name: moved(one) for name, one in robot.experiments.items()}))
