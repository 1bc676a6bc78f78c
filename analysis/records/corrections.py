"""The first stage of all that is learned from logs: whether they are what they seem to be.

What the logs prove about themselves is corrected and said; what they contradict without proving
what is right stops the work, with the remedy.  What proves most is the stated control law, see
`clie_blocks.analysis.records.proof`.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks import Finding, check_record
from clie_blocks.analysis.records.checks.clock import (
    clock_tick,
    even_clock,
    is_coarse,
    is_decimal,
    is_even,
    without_copies,
)
from clie_blocks.analysis.records.checks.completeness import dead_joints
from clie_blocks.analysis.records.checks.law import can_replay
from clie_blocks.analysis.records.checks.measures import moves
from clie_blocks.analysis.records.clock import with_resets_counted_on
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.proof import (
    Misfit,
    is_explained_by_another_filter,
    law_misfit,
    proven_changes,
    replay_as_stated,
)
from clie_blocks.analysis.records.read_positions import read_positions
from clie_blocks.analysis.records.robot import Robot, as_checks_see
from clie_blocks.analysis.records.single_changes import SAME_OFFSET, Change, start_offsets
from clie_blocks.analysis.records.two_encoders import with_law_encoder
from clie_blocks.errors import ClieError, NotIdentifiableError, RecordError

FEW_STEPS = 20.0  # of the encoder, up to which a first position is where it should be
SMALL_OFFSET = 0.01  # rad, likewise

# Errors of a check with which nothing sound can be learned, and no correction was proven.
STOPPING = ("clock.stopped", "clock.backward", "clock.unit", "missing.run", "missing.share",
            "signal.absurd", "reference.copied", "reference.swapped", "reference.sign",
            "reference.side", "law.per_degree", "law.side", "law.sign", "law.swapped",
            "law.coupled", "log.ambiguous", "order.file", "units.inertia", "links.joints")
MOTIONLESS = ("excitation.none", "signal.dead")  # sound logs that cannot answer


@dataclasses.dataclass(frozen=True)
class Correction:
    """What was wrong in the logs beyond doubt, and what was done about it.

    Parameters
    ----------
    check : str
        Stable name for programs, ``family.fault``.
    joints : tuple of str
        Names of the joints; empty for all.
    what, done, why : str
        What the logs have been, what was done, and what proves it; sentences.
    effect : str
        Effect of the catalogue that the fault is; empty for what the catalogue lacks.

    """

    check: str
    joints: tuple[str, ...]
    what: str
    done: str
    why: str
    effect: str = ""

    def __str__(self) -> str:
        return f"{self.what} {self.done} {self.why}"


@dataclasses.dataclass(frozen=True, eq=False)
class Examination:
    """Robot and logs as the work goes on with them, and what was found on the way.

    Parameters
    ----------
    robot : Robot
        The robot.
    records : tuple of Record
        The logs, corrected.
    corrections : tuple of Correction
        What was corrected.
    warnings, obstacles : tuple of Finding
        What makes answers less certain, and what stops the work.

    """

    robot: Robot
    records: tuple[Record, ...]
    corrections: tuple[Correction, ...] = ()
    warnings: tuple[Finding, ...] = ()
    obstacles: tuple[Finding, ...] = ()

    def raise_obstacles(self) -> None:
        """Raise what stops the work, as one error.

        Raises
        ------
        NotIdentifiableError
            If the logs are sound but hold nothing to learn from.
        RecordError
            If they are not what they seem to be.

        """
        if self.obstacles:
            text = " ".join(map(str, self.obstacles))
            still = all(finding.check in MOTIONLESS for finding in self.obstacles)
            error: type[ClieError] = NotIdentifiableError if still else RecordError
            raise error(f"{self.records[0].source}: {text} To go on with the logs as they are: "
                        "--trust-log, in Python trust_logs=True.")


def examine(records: Sequence[Record], robot: Robot) -> Examination:
    """Check the logs of one robot together, and correct what they prove to be wrong.

    Parameters
    ----------
    records : sequence of Record
        The logs.
    robot : Robot
        What is known of the robot.

    Returns
    -------
    Examination
        Of sound logs, the logs themselves.

    """
    robot = as_checks_see(robot)
    seen = correct(records, robot)
    if seen.obstacles:
        return seen
    findings = _once([f for record in seen.records for f in check_record(
        record, robot, [other for other in seen.records if other is not record])])
    return dataclasses.replace(
        seen, warnings=tuple(f for f in findings if f.severity != "repair" and not stops(f)),
        obstacles=tuple(f for f in findings if stops(f)))


def correct(records: Sequence[Record], robot: Robot) -> Examination:
    """Correct the logs of one robot by what they prove together, before each is checked."""
    seen = _with_even_clocks(Examination(robot, with_law_encoder(records, robot)))
    return _with_the_zero_of_the_file(_by_the_law(seen))


def stops(finding: Finding) -> bool:
    """Whether nothing sound can be learned from logs with a finding."""
    return finding.severity == "error" and finding.check in (*STOPPING, *MOTIONLESS)


def _once(findings: Sequence[Finding]) -> list[Finding]:
    """The first of the findings that several logs share, per joint."""
    first: dict[tuple[str, str | None], Finding] = {}
    for finding in findings:
        first.setdefault((finding.check, finding.joint), finding)
    return list(first.values())


def _with_even_clocks(seen: Examination) -> Examination:
    """Logs without rows that were written twice, and with their clocks rebuilt."""
    single = tuple(map(without_copies, seen.records))
    forward = tuple(record if is_coarse(record) else with_resets_counted_on(record)
                    for record in single)
    even = tuple(even_clock(record, seen.robot) for record in forward)
    copies = sum(map(len, seen.records)) - sum(map(len, single))
    corrections = [Correction("clock.repeated", (), f"{copies} rows have the stamp of the next "
                              "one.", "They were left out.", "A sample was logged twice."),
                   ] if copies else []
    reset = sum(record is not other for record, other in zip(single, forward, strict=True))
    if reset:
        corrections.append(Correction(
            "clock.reset", (), f"The clock starts again in the middle of {reset} of "
            f"{len(single)} logs.", "It was counted on.", "Every signal goes on there as it does "
            "between any other rows."))
    rebuilt = [record for record, other in zip(forward, even, strict=True) if other is not record]
    if rebuilt:
        tick = max(map(clock_tick, rebuilt))
        what = (f"The stamps are written to {tick:.0g} s, with too few digits."
                if is_decimal(tick) else f"The clock ticks every {tick:.3g} s, slower than rows "
                "are logged.")
        strict = all(is_even(record) for record in rebuilt)
        corrections.append(Correction(
            "clock.coarse", (), what, "They were rebuilt on an even clock.",
            "Even steps agree with every stamp to one tick." if strict else
            "Rows were late now and then, and their mean agrees with every stamp to three ticks."))
    return dataclasses.replace(seen, records=even, corrections=tuple(corrections))


def _by_the_law(seen: Examination) -> Examination:
    """Logs after the one change that lets the stated law reproduce them, and what was changed.

    Where two different changes explain the logs alike, nothing is changed and both are named.
    """
    records, robot = seen.records, seen.robot
    if not all(can_replay(record, robot) and _is_of(record, robot) for record in records):
        return seen
    before = law_misfit(records, robot)
    joints = [int(k) for k in np.flatnonzero((before.rms > before.limit).any(axis=0))]
    if not joints or is_explained_by_another_filter(records, robot):
        return seen
    dead = [k for k in joints if all(not moves(record.signal("u")[:, k]) for record in records)]
    if dead:
        return _with_replayed_commands(seen, dead, set(dead) == set(joints) and
                                       len(dead) < robot.n)
    proven = proven_changes(records, robot, joints, before)
    if len(proven) > 1 or any(change.remedy for change, _ in proven):
        return dataclasses.replace(seen, obstacles=(
            _contradiction([change for change, _ in proven], robot),))
    for change, changed in proven:
        return _corrected(seen, changed, _correction(change, robot))
    return (_with_lost_excitation(seen, before) or _with_positions_read(seen, joints)
            or dataclasses.replace(
                seen, obstacles=tuple(_dead_channels(records, robot, joints))))


def _is_of(record: Record, robot: Robot) -> bool:
    """Whether a log was taken with the gains of a robot; that it was not is said elsewhere."""
    own = robot if record.robot is None else record.robot
    return own.name == robot.name and all(
        np.array_equal(one, other) if one is not None and other is not None else one is other
        for one, other in ((own.controller.kp, robot.controller.kp),
                           (own.controller.kd, robot.controller.kd)))


def _corrected(seen: Examination, records: Sequence[Record],
               correction: Correction) -> Examination:
    note = f"{correction.what} {correction.done}"
    return dataclasses.replace(
        seen, records=tuple(record.noted(note) for record in records),
        corrections=(*seen.corrections, correction))


def _with_replayed_commands(seen: Examination, dead: Sequence[int],
                            others_proven: bool) -> Examination:
    """Logs with the law's own command where that of a joint was not recorded.

    That the law runs is then proven by the other joints; nothing else needs the lost command.
    """
    names = tuple(seen.robot.joints[k] for k in dead)
    if not others_proven:
        return dataclasses.replace(seen, obstacles=(Finding(
            "error", "command.dead", f"The command of {', '.join(names)} never changes, though "
            "its law asks for it.", "So the logs do not show whether the stated law ran.",
            "Log the command, or name its column: --map u=COLUMN."),))
    records = []
    for record in seen.records:
        replayed, u = replay_as_stated(record, seen.robot).u, record.signal("u").copy()
        u[:, dead] = np.where(np.isfinite(replayed), replayed, 0.0)[:, dead]
        records.append(record.replace(u=u))
    return _corrected(seen, records, Correction(
        "command.dead", names, f"The command u of {', '.join(names)} never changes: it was not "
        "recorded.", "The command of the stated law stands for it.",
        "At the other joints the stated law reproduces the commands of every log."))


def _with_lost_excitation(seen: Examination, before: Misfit) -> Examination | None:
    """Logs with the excitation that their commands hold beyond the law, where one was not logged.

    That the law runs is proven by the logs without excitation, in which it leaves nothing.
    """
    if any(record.pe is not None and moves(record.pe) for record in seen.records):
        return None
    proven = np.all(before.rms <= before.limit, axis=1)
    shown = [record for record, holds in zip(seen.records, proven, strict=True)
             if holds and (np.ptp(record.q, axis=0) > 0).all()]
    if not shown:
        return None
    records = []
    for record, holds in zip(seen.records, proven, strict=True):
        left = replay_as_stated(record, seen.robot).residual
        pe = np.zeros_like(record.q) if holds else np.where(np.isfinite(left), left, 0.0)
        records.append(record.replace(pe=pe))
    names = ", ".join(record.source for record in shown)
    return _corrected(seen, records, Correction(
        "missing.pe", (), "A torque was added to the commands and not logged as pe.",
        "What the commands hold beyond the stated law was taken as pe.",
        f"The law reproduces the commands of {names} to their rounding."))


def _with_positions_read(seen: Examination, joints: Sequence[int]) -> Examination | None:
    """Logs with the positions that the controller read, where those logged hold further noise."""
    found = {k: read_positions(seen.records, seen.robot.controller, k) for k in joints}
    noisy = {k: read for k, read in found.items() if read is not None}
    if not noisy:
        return None
    names = tuple(seen.robot.joints[k] for k in noisy)
    records = []
    for j, record in enumerate(seen.records):
        q = record.q.copy()
        for k, read in noisy.items():
            q[:, k] = read.q[j]
        records.append(record.replace(q=q))
    size = ", ".join(f"{read.noise:.2g}" for read in noisy.values())
    return _corrected(seen, records, Correction(
        "position.noise", names, f"The logged position of {', '.join(names)} holds noise of "
        f"{size} rad RMS that the controller did not read.", "Took the position that its commands "
        "follow from.", "In every log the two differ by white noise and by nothing else."))


def _with_the_zero_of_the_file(seen: Examination) -> Examination:
    """Logs whose positions and references have another zero than the robot file states.

    The law cannot show it, but every log then begins as far from its stated start.  A reference
    that begins there has the zero of the file: an encoder that is eccentric reads so, too.
    """
    offsets = start_offsets(seen.records, seen.robot)
    of_reference = start_offsets(seen.records, seen.robot, "qd")
    if offsets is None or len(offsets) < 2 or of_reference is None:
        return seen
    step = seen.robot.encoder.resolution
    floor = np.maximum(SMALL_OFFSET, FEW_STEPS * (0.0 if step is None else step))
    shift = np.median(offsets, axis=0)
    spread = np.abs(offsets - shift).max(axis=0)
    moved = ((np.abs(shift) > floor) & (spread < SAME_OFFSET * np.abs(shift))
             & (np.median(np.abs(of_reference), axis=0) > SAME_OFFSET * np.abs(shift)))
    if not moved.any():
        return seen
    shift = np.where(moved, shift, 0.0)
    names = ", ".join(seen.robot.joints[k] for k in np.flatnonzero(moved))
    records = [record.replace(q=record.q - shift, qd=record.signal("qd") - shift)
               for record in seen.records]
    shown = ", ".join(f"{shift[k]:.4g}" for k in np.flatnonzero(moved))
    return _corrected(seen, records, Correction(
        "position.zero", tuple(names.split(", ")), f"The position q and reference qd of {names} "
        "have another zero than the robot file.", f"Took {shown} off them.",
        "Every log begins so far from its stated start."))


def _correction(change: Change, robot: Robot) -> Correction:
    names = tuple(robot.joints[k] for k in change.joints)
    what = f"{change.what.format(joints=', '.join(names))}."
    return Correction(change.check, names, what, change.done,
                      "With this and nothing else the stated law reproduces the commands of every "
                      "log to their rounding.", change.effect)


def _contradiction(changes: Sequence[Change], robot: Robot) -> Finding:
    """Stop where the law would hold after a change of the robot file, or one of several."""
    readings = [change.what.format(joints=", ".join(robot.joints[k] for k in change.joints))
                for change in changes]
    if len(changes) == 1:
        return Finding("error", changes[0].check, f"{readings[0]}: then the stated law "
                       "reproduces the commands of every log to their rounding.",
                       "Every joint would be given a wrong model.", changes[0].remedy)
    return Finding("error", "log.ambiguous", "The stated law does not reproduce the commands, "
                   "but would after one change, and the logs leave open which: "
                   f"{'; or: '.join(readings)}.",
                   "One correction mirrors or renames the robot of the other.",
                   "Correct the right one in the log; in robot.toml, start_rad of the experiments "
                   "and resolution_rad of the encoder would decide it too.")


def _dead_channels(records: Sequence[Record], robot: Robot,
                   joints: Sequence[int]) -> list[Finding]:
    """Joints whose position stands still while their controller fights a motion."""
    return [Finding("error", "signal.dead", "Its position never changes, but the commands of its "
                    "controller do not follow from a position that rests.", "The channel is dead, "
                    "so the log says nothing of this joint.",
                    "Look at its cable and its column; log it again, or diagnose the other joints "
                    "from a log and a robot.toml without this one.", joint=robot.joints[k])
            for k in joints if all(k in dead_joints(record, robot) for record in records)]
