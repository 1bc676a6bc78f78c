"""Logs of machines whose command is no torque, in the form that the diagnosis reads.

The diagnosis knows one law, ``u = Kp (q_d - q) - Kd v + pe``, with u in the unit of the joint
model.  A servo's duty cycle becomes the torque of its stalled motor.  A torque-driven machine has
no gains, and all of its command is excitation.  A servo whose law is unknown is driven by its
position error.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.problem import position_path, torque_path
from clie_blocks.analysis.gap.problem.command_unit import in_one_unit
from clie_blocks.analysis.gap.problem.drive_signals import check_signals_of_law
from clie_blocks.analysis.gap.problem.measured_velocity import with_measured_velocity
from clie_blocks.analysis.gap.problem.ticks import on_ticks, tick_period
from clie_blocks.analysis.gap.problem.what_u_is import UNSIGNED, as_u_is, has_sign
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks.clock import even_clock
from clie_blocks.analysis.records.clock import GAP
from clie_blocks.analysis.records.control_law import control_law, gains
from clie_blocks.analysis.records.controller_section import MEASURED, Controller
from clie_blocks.analysis.records.model import SUPPLY
from clie_blocks.analysis.records.replay import sample_time
from clie_blocks.errors import NotIdentifiableError, RecordError
from clie_blocks.robot_loop.sampled_law import read_of_drive

Form = Callable[[Robot, Sequence[Record]], tuple[Robot, list[Record]]]

# Relative, between the steps of logs: from here to there they are brought to a common clock.
UNEVEN_RATE, OTHER_RATE = 1e-3, 0.05
FASTER = 0.99  # of the median step, below which samples would be invented
UNEVEN_CLOCK = 0.02  # standard deviation of the sample time over its mean: a log is resampled
# Share of the standard deviation of the command, above which an unlogged reference moved.
MOVED_REFERENCE = 0.5
SERVO_PERIOD = 1e-3  # s, of the loop in a servo, where it is not stated
COASTING_TIME = 0.1  # s, in which a rotor of unknown damping is assumed to come to rest
COMMANDS_OF_LAW = (
    "No command is logged: it is what the stated law gives on the logged positions. That this law "
    "ran cannot be checked; where all its gains are off by one factor, inertia, friction and "
    "weight are off by the same. A drive that gives more or less than asked for looks so, too.")
QUARTER_TURN = math.pi / 2  # rad, from 'hanging down' to the horizontal arm of `planar_links`


def prepare(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Return robot and records in the form of eq. (11).

    The law of the robot is then of the kind ``pd`` or ``cascade``, the records are on even clocks,
    and what was changed is in their decisions.

    Raises
    ------
    RecordError
        If the logs are of several robots, or of one with several gains.
    NotIdentifiableError
        If a log has neither a command nor a reference: nothing then says what drove the machine.
        Or if it lacks a signal that a law of the user's own reads.

    """
    _check_one_robot(robot, records)
    _check_samples(records)
    robot, records = as_u_is(robot, records)
    check_signals_of_law(robot, records)
    records = [on_even_clock(record, robot.controller) for record in records]
    if robot.controller.law == "unknown":
        records = at_one_rate(records)
    robot, records = in_one_unit(*_form(robot, records)(robot, records))
    robot, records = with_measured_velocity(robot, records)
    return with_damping(robot), records


def _check_one_robot(robot: Robot, records: Sequence[Record]) -> None:
    for record in records:
        other = robot if record.robot is None else record.robot
        if other.name != robot.name or not _have_equal_gains(other, robot):
            raise RecordError(
                f"{records[0].source} and {record.source} are of different robots or gains, and a "
                "diagnosis is of one: choose the logs of one robot with one set of gains, from "
                "Python with Problem.from_logs(robot, records)")


def _have_equal_gains(one: Robot, other: Robot) -> bool:
    kp, other_kp = one.controller.kp, other.controller.kp
    if kp is None or other_kp is None:
        return kp is other_kp
    return np.array_equal(kp, other_kp)


def _check_samples(records: Sequence[Record]) -> None:
    for record in records:
        if len(record) < 2:
            raise RecordError(f"{record.source} has {len(record)} sample(s); record "
                              "at least 20 s of motion at the period of the controller")


def _form(robot: Robot, records: Sequence[Record]) -> Form:
    if robot.controller.law == "servo":
        return duty_as_torque
    if robot.controller.is_block:
        return with_commands_of_law
    if robot.controller.law != "unknown":
        return lambda same, logs: with_commands_of_law(
            same, [with_reference(log, same) for log in logs])
    if records[0].u is not None:
        return command_as_excitation
    drives = records[0].tau is not None and (records[0].qd is None or has_sign(records))
    return torque_as_excitation if drives else position_error_as_command


def with_commands_of_law(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Robot and records of a stated law, which computes what was not recorded of its commands.

    Raises
    ------
    NotIdentifiableError
        If a log has neither a command nor a reference.

    """
    for record in records:
        if record.u is None and record.pe is None:
            _reference(record)
    return robot, [record if record.u is not None else record.noted(COMMANDS_OF_LAW)
                   for record in records]


def with_reference(record: Record, robot: Robot) -> Record:
    """Record whose excitation contains the reference, where no reference was logged.

    What the logged command contains beyond the stated law with a reference at the first position
    is ``kp (q_d - q_0) + pe``.  A reference at another position gives a constant.  Where this rest
    is most of the command, the reference moved; where it is little, the law may not be the stated
    one, which the controller check decides.
    """
    if record.qd is not None or record.u is None:
        return record
    law = control_law(robot.controller, sample_time(record, robot.controller))
    excitation = np.zeros_like(record.q) if record.pe is None else record.pe
    rest = record.u - law.replay(record.q, record.q[:1], excitation)
    moved = np.std(rest, axis=0) > MOVED_REFERENCE * np.std(record.u, axis=0)
    record = record.replace(pe=excitation + np.where(moved, rest, rest.mean(axis=0)))
    return record.noted("No reference was logged: it is read from the command, by the stated "
                        "law.") if moved.any() else record


def on_even_clock(record: Record, controller: Controller) -> Record:
    """Return a record on an even clock, itself where it already is.

    The ticks of a controller are even, whatever the stamps say.  Samples of a machine whose
    controller is unknown were taken when their stamps say: those are brought to an even clock.
    """
    record = even_clock(record)
    period = tick_period(record, controller)
    if controller.law == "unknown" and period == record.sample_time:
        record = _resampled(record)
        period = record.sample_time
    return on_ticks(record, period, read_of_drive(controller.block))


def _resampled(record: Record) -> Record:
    """Record on an even clock, where the steps of its own vary otherwise than by lost rows."""
    from clie_blocks.analysis.records import resample

    steps, period = np.diff(record.time), record.sample_time
    steps = steps[(steps > 0) & (steps <= GAP * period)]
    off_tick = steps / period - np.maximum(np.rint(steps / period), 1)
    if np.std(off_tick) < UNEVEN_CLOCK:
        return record
    mean = float(np.mean(steps))
    return resample(record, mean if mean > FASTER * period else period, float(record.time[0]))


def at_one_rate(records: Sequence[Record]) -> list[Record]:
    """Records on a common clock, where their own differ by little."""
    steps = np.array([record.sample_time for record in records])
    common = float(steps.max())
    apart = 1.0 - steps / common
    return [on_ticks(_with_step(record, common), common)
            if UNEVEN_RATE < off < OTHER_RATE else record for record, off in zip(records, apart)]


def _with_step(record: Record, step: float) -> Record:
    """Record with a slightly longer step [s]; torques between its samples follow a line."""
    from clie_blocks.analysis.records import resample

    origin = float(record.time[0])
    resampled = resample(record, step, origin)
    if record.u is None:
        return resampled
    return resampled.replace(u=resample(record.replace(u=None, tau=record.u), step, origin).tau)


def duty_as_torque(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Duty cycles as the torque that the stalled motor gives at its nominal supply [N m].

    With back-EMF the torque is k_t (duty V - k_t dq) / R: the first part is the command, the
    second is viscous friction.  Where the voltage V was logged, the first part grows with it; else
    a supply that sags shows as an error of the torque gain.
    """
    law, torque = robot.controller, torque_at_full_duty(robot)
    scale, unit = (np.ones(robot.n), "duty") if torque is None else (torque, "N m")
    note = f"u is {unit}, {scale[0]:.4g} {unit} at full duty; back-EMF counts as damping."
    if law.supply is not None and all(SUPPLY in record.extra for record in records):
        note += f" Torques follow the logged voltage, {law.supply:g} V being the nominal one."
    kp, _ = gains(law)
    controller = dataclasses.replace(
        law, law="pd", kp=kp * scale, kd=0.0 * scale, velocity_filter="difference",
        saturation=None if law.saturation is None else law.saturation * scale,
        punch=None if law.punch is None else law.punch * scale, command_resolution=None)
    stated = dataclasses.replace(robot, controller=controller, units={})
    known = stated
    stated = _with_hanging_links(stated) if unit == "N m" else stated
    turn = QUARTER_TURN if stated is not known else 0.0
    return stated, [
        record.replace(u=None if record.u is None else record.u * scale, q=record.q - turn,
                       qd=None if record.qd is None else record.qd - turn, units={"u": unit},
                       robot=stated).noted(note) for record in records]


def torque_at_full_duty(robot: Robot) -> np.ndarray | None:
    """Torque of the stalled motors at their nominal supply [N m], shape (n,); None if unknown."""
    motor, supply = robot.motor, robot.controller.supply
    if motor.torque_constant is None or motor.resistance is None or supply is None:
        return None
    return supply * motor.torque_constant / motor.resistance


def command_as_excitation(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Commanded torques as excitation of a machine without feedback."""
    zero = np.zeros(robot.n)
    controller = dataclasses.replace(robot.controller, law="pd", kp=zero, kd=zero,
                                     velocity_filter="difference")
    known = dataclasses.replace(robot, controller=controller)
    stated = _with_hanging_links(known)
    turn = np.zeros(robot.n)
    turn[0] = QUARTER_TURN if stated is not known else 0.0
    acting = "measured torque" if robot.controller.u_is == MEASURED else "command"
    note = f"No law is known: the {acting} acts as excitation, without feedback."
    return stated, [record.replace(pe=record.u, q=record.q - turn, robot=stated,
                                   qd=None if record.qd is None else record.qd - turn)
                    .noted(" ".join([note, *torque_path.describe(record)])) for record in records]


def torque_as_excitation(robot: Robot, records: Sequence[Record]) -> tuple[Robot, list[Record]]:
    """Measured torques as excitation of a machine of which nothing else was logged."""
    controller = dataclasses.replace(robot.controller, u_is=MEASURED)
    note = ("No command is logged: the measured torque drives the model, and nothing that a drive "
            "does to a command can show.")
    return command_as_excitation(
        dataclasses.replace(robot, controller=controller),
        [record.replace(u=record.tau, tau=None, units={**record.units, "u": record.units["tau"]})
         .noted(note) for record in records])


def position_error_as_command(robot: Robot, records: Sequence[Record],
                              ) -> tuple[Robot, list[Record]]:
    """Position errors of a servo, which stand for its unknown command."""
    controller = dataclasses.replace(
        robot.controller, law="pd", kp=np.ones(robot.n), kd=np.zeros(robot.n),
        velocity_filter="difference",
        sample_time=robot.controller.sample_time or SERVO_PERIOD)
    motor = dataclasses.replace(robot.motor, viscous_friction=None,
                                viscous_friction_tolerance=None)
    stated = dataclasses.replace(robot, controller=controller, motor=motor)
    note = ("The command is not logged: the position error stands for it, and the damping "
            "includes that of the servo. Unless links show it, friction, weight and inertia are "
            "known over the gain of the servo, in rad of error.")
    note = " ".join([note, *([UNSIGNED] if records[0].tau is not None else []),
                     *_position_paths(records)])
    return stated, [record.replace(u=_reference(record) - record.q, robot=stated,
                                   units={**record.units, "u": record.units["q"]}).noted(note)
                    for record in records]


def _reference(record: Record) -> np.ndarray:
    """Reference of a record without a command, shape (N, n) [rad]."""
    if record.qd is None:
        raise NotIdentifiableError(
            f"{record.source} has neither a command u nor a reference qd, so that nothing says "
            "what drove the machine; log one of them")
    return record.qd


def _position_paths(records: Sequence[Record]) -> list[str]:
    """Path from set-point to motion of each joint whose set-point moves, in sentences."""
    for record in records:
        _reference(record)
    record, _ = position_path.fitted_and_unseen(records)
    moving = np.flatnonzero(np.ptp(_reference(record), axis=0) > 0)
    return [position_path.describe(record, int(k)) for k in moving]


def _with_hanging_links(robot: Robot) -> Robot:
    """Robot with gravity and coupling in its nominal model, where it has known, hanging links.

    A file that says whether the model has gravity is believed; its angle zero is the horizontal.
    """
    links = robot.links
    unknown = links.mass is None or links.com is None or links.length is None
    if robot.nominal.gravity is not None or unknown:
        return robot
    return dataclasses.replace(robot, nominal=dataclasses.replace(
        robot.nominal, gravity=True, coupling=robot.n == 2))


def with_damping(robot: Robot) -> Robot:
    """Return the robot with a first value of damping, where only an inertia is stated."""
    motor = robot.motor
    if motor.inertia is None or motor.viscous_friction is not None:
        return robot
    return dataclasses.replace(robot, motor=dataclasses.replace(
        motor, viscous_friction=motor.inertia / COASTING_TIME))
