"""What can and cannot be diagnosed from a log, and the experiment that would help most."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks.completeness import dead_joints
from clie_blocks.analysis.records.checks.excitation import ANY_REMEDY, Motion, motions, remedy
from clie_blocks.analysis.records.checks.law import (
    can_replay,
    explained_rms,
    fit_law,
    law_parts,
    replay_unsaturated,
)
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.repeatability import NoiseFloor, noise_floor
from clie_blocks.analysis.records.robot import Robot

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
    """What the capabilities of a log follow from."""

    motions: Sequence[Motion]
    floor: NoiseFloor
    law: str
    alive: list[int]


def facts(record: Record, robot: Robot | None, others: Sequence[Record] = ()) -> Facts:
    """Gather motions, noise floor and state of the law; repeats may be among other runs."""
    dead = dead_joints(record, robot)
    return Facts(motions(record, robot), noise_floor(record, *others), _law(record, robot),
                 [k for k in range(record.n) if k not in dead])


def capabilities(record: Record, robot: Robot | None, known: Facts) -> list[Capability]:
    """What can be diagnosed from a log: one capability per question, in the diagnosis' order."""
    rate = 1 / record.sample_time
    moved = [known.motions[k] for k in known.alive]
    driven = record.u is not None or record.tau is not None or record.qd is not None
    reversals = min((m.reversals for m in moved), default=0)
    sweep = max((m.sweep for m in moved), default=0.0)
    slow = max((m.slow_share for m in moved), default=0.0)
    return [
        _parameters(record, robot, known, driven),
        Capability("controller: gains, filter, timing", known.law == "understood", known.law),
        Capability("dry friction, backlash", driven and reversals >= 4,
                   _reason(driven, f"{reversals} reversals on the joint with fewest")),
        Capability("friction at low speed (Stribeck, presliding)",
                   driven and slow > 0.05 and reversals >= 4,
                   _reason(driven, f"{slow:.0%} of the motion is slow")),
        Capability("gravity, payload", driven and sweep > WEIGHT_SWEEP,
                   _reason(driven, f"the widest sweep is {sweep:.3g} {record.units['q'][0]}")),
        Capability("torque gain, load-dependent friction", _is_commanded(record) and bool(moved),
                   "the command is logged" if _is_commanded(record) else
                   "what the drive was asked for is not logged"),
        Capability("delay, actuator lag, elasticity", driven and rate >= FAST,
                   _reason(driven, f"logged at {rate:.4g} Hz; nothing shows below "
                           f"{1e3 / rate:.3g} ms")),
        Capability("ripple, eccentricity", driven and _turns(robot, moved) > 1,
                   _reason(driven, f"the motor makes {_turns(robot, moved):.2g} turns")),
        Capability("coupling between joints", driven and len(known.alive) > 1,
                   _reason(driven, f"{len(known.alive)} of {record.n} joints move")),
        Capability("drift, disturbance, fault", driven and record.duration >= LONG,
                   _reason(driven, f"{record.duration:.3g} s long")),
        Capability("how much of the gap is noise", not known.floor.caveat,
                   known.floor.caveat or f"{known.floor.repeats} {known.floor.method} compared")]


def _is_commanded(record: Record) -> bool:
    """Whether u is what was asked for, and not the torque or current that was measured."""
    return record.u is not None and (
        record.tau is None or not np.array_equal(record.u, record.tau, equal_nan=True))


def best_experiment(record: Record, known: Facts) -> str:
    """The one thing that would help most, as a sentence."""
    if record.u is None and record.tau is None:
        return "Log the command of the controller (u) with the position."
    if known.law.startswith("not stated") and record.qd is not None:
        return ("State the control law and its gains in robot.toml; that helps more than further "
                "data.")
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


def _parameters(record: Record, robot: Robot | None, known: Facts, driven: bool) -> Capability:
    subject = "inertia, viscous friction, offset"
    weak = [k for k in known.alive if known.motions[k].hidden]
    if not driven or not known.alive:
        return Capability(subject, False, _reason(driven, "no joint moves"))
    where = f"not on {', '.join(record.joints[k] for k in weak)}" if weak else (
        "on every joint that moves")
    return Capability(subject, len(weak) < len(known.alive),
                      where + _without_torque(record, robot))


def _without_torque(record: Record, robot: Robot | None) -> str:
    """What stands for a torque that was not logged, and what that costs."""
    if record.u is not None or record.tau is not None:
        return ""
    if robot is not None and robot.controller.law != "unknown":
        return "; the command is what the stated law gives"
    return "; but over the gain of the servo, since neither command nor law is known"


def _reason(driven: bool, reason: str) -> str:
    return reason if driven else "neither command, torque nor reference is logged"


def _turns(robot: Robot | None, moved: Sequence[Motion]) -> float:
    """Turns of the motor's shaft over the widest sweep; one gear ratio stands for all."""
    ratio = 1.0 if robot is None or robot.motor.gear_ratio is None else max(robot.motor.gear_ratio)
    return ratio * max((m.sweep for m in moved), default=0.0) / (2 * np.pi)


def _law(record: Record, robot: Robot | None) -> str:
    if robot is not None and can_replay(record, robot):
        unexplained = np.zeros(record.n, bool)
        for part in law_parts(record):
            best = replay_unsaturated(part, robot)
            unexplained |= best.rms > explained_rms(part, robot, best)
        left = [record.joints[k] for k in np.flatnonzero(unexplained)]
        return f"not reproduced on {', '.join(left)}" if left else "understood"
    if record.u is None or record.qd is None:
        return "unknown: " + ("no command" if record.u is None else "no reference") + " is logged"
    if record.robot is not None and record.robot.controller.is_program:
        return "a program of your own, which 'clie diagnose --run-law' replays"
    if record.robot is not None and record.robot.controller.is_block:
        return f"the law {record.robot.controller.law!r}, which 'clie diagnose' replays"
    return "not stated" + _recognised_law(record)


def _recognised_law(record: Record) -> str:
    """Gains that an unstated PD law has by the log, where it is one."""
    record = law_parts(record)[0]
    u = record.signal("u")
    fits = [fit for k in range(record.n) if (fit := fit_law(record, Controller(), k)) is not None
            and fit.rms <= LINEAR * np.nanstd(u[:, k])]
    if len(fits) < record.n:
        return ""
    gains = "; ".join(", ".join(f"{name} {fit.gains[key][0]:.4g} +- {fit.gains[key][1]:.2g}"
                                for key, name in (("q", "Kp"), ("dq", "Kd")) if key in fit.gains)
                      for fit in fits)
    return f", but the log shows a PD law with {gains}"
