"""Logs of machines whose command is no torque, in the form that the diagnosis reads.

The diagnosis knows one law, ``u = Kp (q_d - q) - Kd v + pe``, with u in the unit of the joint
model.  A servo's duty cycle becomes the torque of its stalled motor, a torque-driven machine has
no gains and all of its command is excitation, and a servo whose law is unknown is driven by its
position error.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.problem import position_path, torque_path
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.replay import sample_time
from clie_blocks.errors import NotIdentifiableError, RecordError

Form = Callable[[Robot, Sequence[Record]], tuple[Robot, list[Record]]]

UNEVEN = 0.02  # spread of the sample time from which on a log is put on an even clock
MOST = 0.5  # of the command, by its standard deviation
COASTING = 0.1  # s, in which a rotor of unknown damping is taken to come to rest
QUARTER = math.pi / 2  # from 'hanging down' to the horizontal arm of `links`


def prepare(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Return robot and records in the form of eq. (11).

    Parameters
    ----------
    robot : Robot
        What is known.
    records : list of Record
        Its logs.

    Returns
    -------
    robot : Robot
        With a law of the kind ``pd`` or ``cascade``.
    records : list of Record
        On even clocks; what was done is in their decisions.

    Raises
    ------
    RecordError
        If the logs are of several robots, or of one with several gains.
    NotIdentifiableError
        If a log has neither a command nor a reference: nothing then says what drove the machine.

    """
    _check_one_robot(robot, records)
    _check_samples(records)
    records = [on_even_clock(record) for record in records]
    robot, records = _form(robot, records)(robot, records)
    return with_damping(robot), records


def _check_one_robot(robot: Robot, records: Sequence[Record]) -> None:
    for record in records:
        other = robot if record.robot is None else record.robot
        if other.name != robot.name or not np.array_equal(other.controller.kp,
                                                          robot.controller.kp):
            raise RecordError(
                f"{records[0].source} and {record.source} are of different robots or gains, and a "
                "diagnosis is of one: choose the logs of one robot with one set of gains, from "
                "Python with Problem.from_logs(robot, records)")


def _check_samples(records: Sequence[Record]) -> None:
    for record in records:
        if len(record) < 2:
            raise RecordError(f"{record.source} has {len(record)} sample(s); record "
                              "at least 20 s of motion at the period of the controller")
        for key in ("q", "u", "qd", "pe", "tau"):
            signal = getattr(record, key)
            if signal is not None and not np.isfinite(signal).all():
                lost = ~np.isfinite(signal).all(axis=1)
                raise RecordError(
                    f"{record.source}: {key} is NaN or infinite in {lost.sum()} of {len(record)} "
                    f"samples, first at {record.time[np.argmax(lost)]:.6g} s; the simulation "
                    "needs every sample: cut the log there, or fill short gaps")


def _form(robot: Robot, records: Sequence[Record]) -> Form:
    first = records[0]
    if robot.controller.law == "servo":
        return duty_as_torque
    if robot.controller.law != "unknown":
        return lambda same, logs: (same, [with_reference(log, same) for log in logs])
    if first.u is None and first.qd is None:
        raise NotIdentifiableError(
            f"{first.source} has neither a command u nor a reference qd, so that nothing says "
            "what drove the machine; log one of them")
    return position_error_as_command if first.u is None else command_as_excitation


def with_reference(record: Record, robot: Robot) -> Record:
    """Record whose excitation holds what was asked of the joints, where no reference was logged.

    The law tells it: what the logged command holds beyond that of a reference at the first
    position is ``kp (q_d - q_0) + pe``.  Its mean is a reference elsewhere.  Where the rest is
    most of the command, the reference moved; where it is little, the law may not be the stated
    one, which is for the controller check to say.
    """
    if record.qd is not None or record.u is None:
        return record
    law = control_law(robot.controller, sample_time(record, robot.controller))
    excitation = np.zeros_like(record.q) if record.pe is None else record.pe
    rest = record.u - law.replay(record.q, record.q[:1], excitation)
    moved = np.std(rest, axis=0) > MOST * np.std(record.u, axis=0)
    note = (("No reference was logged: what was asked of the joints is read from the command, as "
             "the stated law makes it."),) if moved.any() else ()
    return record.replace(
        pe=excitation + np.where(moved, rest, rest.mean(axis=0))).noted(*note)


def on_even_clock(record: Record) -> Record:
    """Return a record on an even clock, itself where it already is."""
    from clie_blocks.analysis.records import resample

    steps, period = np.diff(record.time), record.sample_time
    if np.std(steps) < UNEVEN * period:
        return record
    return resample(record, float(np.mean(steps)))


def duty_as_torque(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Duty cycles as the torque that the stalled motor gives at its nominal supply [N m].

    With back-EMF the torque is k_t (duty V - k_t dq) / R: the first part is the command, the
    second is viscous friction.  A supply that sags shows as an error of the torque gain.
    """
    motor, law = robot.motor, robot.controller
    if motor.torque_constant is None or motor.resistance is None or law.supply is None:
        scale, unit = np.ones(robot.n), "duty"
    else:
        scale, unit = law.supply * motor.torque_constant / motor.resistance, "N m"
    note = f"u is {unit}, {scale[0]:.4g} {unit} at full duty; back-EMF counts as damping."
    controller = dataclasses.replace(
        law, law="pd", kp=law.kp * scale, kd=0.0 * scale, velocity_filter="difference",
        saturation=None if law.saturation is None else law.saturation * scale,
        command_resolution=None)
    stated = dataclasses.replace(robot, controller=controller, units={})
    stated = _with_hanging_links(stated) if unit == "N m" else stated
    turn = QUARTER if stated.nominal.gravity else 0.0
    return stated, [record.replace(u=record.u * scale, q=record.q - turn, qd=record.qd - turn,
                                   units={}, robot=stated).noted(note) for record in records]


def command_as_excitation(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Commanded torques as excitation of a machine without feedback."""
    zero = np.zeros(robot.n)
    controller = dataclasses.replace(robot.controller, law="pd", kp=zero, kd=zero,
                                     velocity_filter="difference")
    stated = _with_hanging_links(dataclasses.replace(robot, controller=controller))
    turn = np.zeros(robot.n)
    turn[0] = QUARTER if stated.nominal.gravity else 0.0
    note = "No law is known: the command acts as excitation, without feedback."
    return stated, [record.replace(pe=record.u, q=record.q - turn, robot=stated)
                    .noted(" ".join([note, *torque_path.describe(record)])) for record in records]


def position_error_as_command(robot: Robot, records: Sequence[Record],
                              ) -> tuple[Robot, list[Record]]:
    """The position error of a servo in the place of its unknown command."""
    controller = dataclasses.replace(
        robot.controller, law="pd", kp=np.ones(robot.n), kd=np.zeros(robot.n),
        velocity_filter="difference")
    stated = dataclasses.replace(robot, controller=controller)
    note = ("The command is not logged: the position error stands for it, so that torques are in "
            "rad of error and damping holds the servo's own.")
    note = " ".join([note, *_paths(records[0])])
    return stated, [record.replace(u=record.qd - record.q, robot=stated).noted(note)
                    for record in records]


def _paths(record: Record) -> list[str]:
    """What the way from goal to motion says of each joint whose goal moves."""
    moving = np.flatnonzero(np.ptp(record.qd, axis=0) > 0)
    return [position_path.describe(record, int(k)) for k in moving]


def _with_hanging_links(robot: Robot) -> Robot:
    """Robot whose links are known and hang down at q = 0: gravity and coupling are nominal."""
    links = robot.links
    if links.mass is None or links.com is None or links.length is None:
        return robot
    return dataclasses.replace(robot, nominal=dataclasses.replace(
        robot.nominal, gravity=True, coupling=robot.n == 2))


def with_damping(robot: Robot) -> Robot:
    """Return the robot with a damping to start from, where an inertia is stated without one."""
    motor = robot.motor
    if motor.inertia is None or motor.viscous_friction is not None:
        return robot
    return dataclasses.replace(robot, motor=dataclasses.replace(
        motor, viscous_friction=motor.inertia / COASTING))
