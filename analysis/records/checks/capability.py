"""What can and cannot be diagnosed from a log, and the experiment that would help most."""

import dataclasses

import numpy as np

from clie_blocks.analysis.records.checks.completeness import dead_joints
from clie_blocks.analysis.records.checks.excitation import ANY_REMEDY, motions, remedy
from clie_blocks.analysis.records.checks.law import can_replay, compared, fit_law, unexplained
from clie_blocks.analysis.records.repeatability import noise_floor
from clie_blocks.analysis.records.robot import Controller

WEIGHT_SWEEP = 0.5  # rad from which gravity's curve shows
FAST = 200.0  # Hz of logging from which lags of milliseconds and structural modes show
LONG = 10.0  # s
LINEAR = 0.02  # share of the command that a recognised law may leave


@dataclasses.dataclass(frozen=True)
class Capability:
    """Whether a log can answer a question, and why."""

    subject: str
    possible: bool
    reason: str


@dataclasses.dataclass(frozen=True, eq=False)
class Facts:
    """What the capabilities of a log are judged by."""

    motions: list
    floor: object
    law: str
    alive: list


def facts(record, robot, others=()):
    """Gather motions, noise floor and the state of the control law.

    Parameters
    ----------
    record : Record
        The log.
    robot : Robot or None
        What is known of the robot.
    others : sequence of Record
        Further runs of the same robot, among which may be repeats.

    """
    dead = dead_joints(record, robot)
    return Facts(motions(record, robot), noise_floor(record, *others), _law(record, robot),
                 [k for k in range(record.n) if k not in dead])


def capabilities(record, robot, known):
    """What can be diagnosed from a log.

    Parameters
    ----------
    record : Record
        The log.
    robot : Robot or None
        What is known of the robot.
    known : Facts
        From `facts`.

    Returns
    -------
    list of Capability
        One per question, in the order of the diagnosis.

    """
    rate = 1 / record.sample_time
    moved = [known.motions[k] for k in known.alive]
    driven = record.u is not None or record.tau is not None
    reversals = min((m.reversals for m in moved), default=0)
    sweep = max((m.sweep for m in moved), default=0.0)
    slow = max((m.slow_share for m in moved), default=0.0)
    return [
        _parameters(record, known, driven),
        Capability("controller: gains, filter, timing", known.law == "understood", known.law),
        Capability("dry friction, backlash", driven and reversals >= 4,
                   _lacking(driven, f"{reversals} reversals on the joint with fewest")),
        Capability("friction at low speed (Stribeck, presliding)",
                   driven and slow > 0.05 and reversals >= 4,
                   _lacking(driven, f"{slow:.0%} of the motion is slow")),
        Capability("gravity, payload", driven and sweep > WEIGHT_SWEEP,
                   _lacking(driven, f"the widest sweep is {sweep:.3g} {record.units['q'][0]}")),
        Capability("torque gain, load-dependent friction", driven and bool(moved),
                   _lacking(driven, "the command is logged")),
        Capability("delay, actuator lag, elasticity", driven and rate >= FAST,
                   _lacking(driven, f"logged at {rate:.4g} Hz; below {1e3 / rate:.3g} ms nothing "
                            "can be told")),
        Capability("ripple, eccentricity", driven and _turns(robot, moved) > 1,
                   _lacking(driven, f"the motor makes {_turns(robot, moved):.2g} turns")),
        Capability("coupling between joints", driven and len(known.alive) > 1,
                   f"{len(known.alive)} of {record.n} joints move"),
        Capability("drift, disturbance, fault", driven and record.duration >= LONG,
                   _lacking(driven, f"{record.duration:.3g} s long")),
        Capability("how much of the gap is noise", not known.floor.caveat,
                   known.floor.caveat or f"{known.floor.repeats} {known.floor.method} compared")]


def best_experiment(record, known):
    """The one thing that would help most, as a sentence."""
    if record.u is None and record.tau is None:
        return "Log the command of the controller (u) beside the position."
    if known.law.startswith("not stated") and record.qd is not None:
        return "State the control law and its gains in robot.toml; they are worth more than data."
    if record.qd is None:
        return "Log the reference (qd), and any injected torque (pe), so that the loop is known."
    weak = [k for k in known.alive if known.motions[k].hidden]
    if weak:
        return (f"Excite {', '.join(record.joints[k] for k in weak)}: "
                f"{remedy(known.motions[weak[0]].hidden)}.")
    if min((known.motions[k].reversals for k in known.alive), default=0) < 4:
        return "Add a slow triangle of the reference, at least four reversals on every joint."
    if known.floor.caveat:
        return ("Repeat one motion three times or more in one log: it is the only measurement of "
                "the noise, and shows how small the gap can get.")
    if max((known.motions[k].slow_share for k in known.alive), default=0) <= 0.05:
        return "Add a slow triangle of the reference, which shows friction at low speed."
    return f"Take another log with {ANY_REMEDY}, and keep it back for validation."


def _parameters(record, known, driven):
    weak = [k for k in known.alive if known.motions[k].hidden]
    if not driven:
        return Capability("inertia, viscous friction, offset", False,
                          "neither command nor torque is logged")
    if not weak:
        return Capability("inertia, viscous friction, offset", bool(known.alive),
                          "on every joint that moves" if known.alive else "no joint moves")
    return Capability("inertia, viscous friction, offset", len(weak) < len(known.alive),
                      "not on " + ", ".join(record.joints[k] for k in weak))


def _lacking(driven, reason):
    return reason if driven else "neither command nor torque is logged"


def _turns(robot, moved):
    """Turns of the motor's shaft over the widest sweep; one gear ratio stands for all."""
    ratio = 1.0 if robot is None or robot.motor.gear_ratio is None else max(robot.motor.gear_ratio)
    return ratio * max((m.sweep for m in moved), default=0.0) / (2 * np.pi)


def _law(record, robot):
    if can_replay(record, robot):
        strange = unexplained(record, compared(record, robot.controller))
        left = [record.joints[k] for k in np.flatnonzero(strange)]
        return f"not reproduced on {', '.join(left)}" if left else "understood"
    if record.u is None or record.qd is None:
        return "unknown: " + ("no command" if record.u is None else "no reference") + " is logged"
    return "not stated" + _recognised(record)


def _recognised(record):
    """Gains that an unstated PD law has by the log, where it is one."""
    fits = [fit_law(record, Controller(), k) for k in range(record.n)]
    if any(fit is None or fit.rms > LINEAR * np.nanstd(record.u[:, k])
           for k, fit in enumerate(fits)):
        return ""
    said = "; ".join(", ".join(f"{name} {fit.gains[key][0]:.4g} +- {fit.gains[key][1]:.2g}"
                               for key, name in (("q", "Kp"), ("dq", "Kd")) if key in fit.gains)
                     for fit in fits)
    return f", but the log shows a PD law with {said}"
