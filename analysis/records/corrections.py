"""The first stage of all that is learned from logs: whether they are what they seem to be.

What the logs prove about themselves is corrected and said; what they contradict without proving
what is right stops the work, with the remedy.  Proof is the stated control law: replayed on the
logged positions it gives the logged commands to their rounding, and where it does so only after
one change of the signals, on all logs of the robot, that change is what the recorder did.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks import Finding, check_record
from clie_blocks.analysis.records.checks.completeness import dead_joints
from clie_blocks.analysis.records.checks.law import (
    can_replay,
    explained_rms,
    replay_unsaturated,
)
from clie_blocks.analysis.records.checks.measures import step_size
from clie_blocks.analysis.records.control_law import stated_variant
from clie_blocks.analysis.records.law_residual import ROUNDED_SHARE, ROUNDED_STEPS
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import Replay, variants
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.single_changes import Change, single_changes
from clie_blocks.errors import ClieError, NotIdentifiableError, RecordError

SHARPER = 0.1  # of the residual of the law that may be left by a change that proves itself
OTHER_STEP = 1.5  # times the stated step of the position: it was rounded once more in the log
MOST_ROUNDED = 0.05  # of the command's RMS that rounding of the logged position may explain
AWAY = 0.1  # of the range of motion, from the stated start, at which a log begins elsewhere

# Errors of a check with which nothing sound can be learned, and no correction was proven.
STOPPING = ("clock.stopped", "clock.backward", "clock.unit", "missing.run", "missing.share",
            "signal.absurd", "reference.copied", "reference.swapped", "reference.sign",
            "reference.side", "law.per_degree", "law.side", "law.sign", "law.swapped",
            "log.ambiguous", "missing.pe")
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

    """

    check: str
    joints: tuple[str, ...]
    what: str
    done: str
    why: str

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
    records = tuple(records)
    corrected, corrections, doubts = _by_the_law(records, robot)
    findings = _once([*doubts, *(finding for record in corrected
                                 for finding in check_record(record, robot))])
    return Examination(
        robot, corrected, corrections,
        warnings=tuple(f for f in findings if f.severity != "repair" and not _stops(f)),
        obstacles=tuple(f for f in findings if _stops(f)))


def _stops(finding: Finding) -> bool:
    return finding.severity == "error" and finding.check in (*STOPPING, *MOTIONLESS)


def _once(findings: Sequence[Finding]) -> list[Finding]:
    """The first of the findings that several logs share, per joint."""
    first: dict[tuple[str, str | None], Finding] = {}
    for finding in findings:
        first.setdefault((finding.check, finding.joint), finding)
    return list(first.values())


def _by_the_law(records: tuple[Record, ...], robot: Robot,
                ) -> tuple[tuple[Record, ...], tuple[Correction, ...], tuple[Finding, ...]]:
    """Logs after the one change that lets the stated law reproduce them, and what was changed.

    Where two different changes explain the logs alike, nothing is changed and both are named.
    """
    if not all(can_replay(record, robot) for record in records):
        return records, (), ()
    before = _law_misfit(records, robot)
    joints = [int(k) for k in np.flatnonzero((before.rms > before.limit).any(axis=0))]
    if not joints or _explained_by_another_filter(records, robot):
        return records, (), ()
    proven = _proven_changes(records, robot, joints, before)
    if len(proven) > 1:
        return records, (), (_ambiguous([change for change, _ in proven], robot),)
    for change, changed in proven:
        correction = _correction(change, robot)
        return (tuple(record.noted(f"{correction.what} {correction.done}") for record in changed),
                (correction,), ())
    return records, (), tuple(_dead_channels(records, robot, joints))


@dataclasses.dataclass(frozen=True, eq=False)
class _Misfit:
    """RMS of what a law leaves of the commands, and what rounding explains, shape (logs, n)."""

    rms: np.ndarray
    limit: np.ndarray


def _law_misfit(records: Sequence[Record], robot: Robot) -> _Misfit:
    replays = [_replay_as_stated(record, robot) for record in records]
    return _Misfit(np.array([replay.rms for replay in replays]),
                   np.array([explained_rms(record, robot, replay)
                             for record, replay in zip(records, replays, strict=True)]))


def _replay_as_stated(record: Record, robot: Robot) -> Replay:
    return replay_unsaturated(record, robot, stated_variant(robot.controller))


def _explained_by_another_filter(records: Sequence[Record], robot: Robot) -> bool:
    """Whether the law explains every log with another velocity filter: a matter of the file."""
    replays = [replay_unsaturated(record, robot) for record in records]
    return all((replay.rms <= explained_rms(record, robot, replay)).all()
               for record, replay in zip(records, replays, strict=True))


def _proven_changes(records: tuple[Record, ...], robot: Robot, joints: Sequence[int],
                    before: _Misfit) -> list[tuple[Change, tuple[Record, ...]]]:
    """Changes after which the law explains all logs, with the changed logs.

    Of changes that explain the logs alike, those count with which the logs begin where the robot
    file says that they do.
    """
    proven = []
    for change in single_changes(records, robot, joints, _variant(records[0], robot)):
        changed = tuple(change.apply(record) for record in records)
        if _is_proof(_law_misfit(changed, robot), before, changed, robot, change.joints):
            proven.append((change, changed))
    if len(proven) < 2:
        return proven
    errors = [_start_error(changed, robot) for _, changed in proven]
    return [pair for pair, error in zip(proven, errors, strict=True)
            if error <= max(min(errors), AWAY)]


def _variant(record: Record, robot: Robot) -> str | None:
    """Velocity filter to look for a change with: the stated one, else that which fits best."""
    stated = stated_variant(robot.controller)
    if stated in variants(record, robot.controller):
        return stated
    return replay_unsaturated(record, robot).variant


def _is_proof(after: _Misfit, before: _Misfit, changed: Sequence[Record], robot: Robot,
              joints: Sequence[int]) -> bool:
    """Whether every joint is explained on every log, and those changed are so much better."""
    limit = np.maximum(after.limit, [_rounding(record, robot) for record in changed])
    at = list(joints)
    unexplained = before.rms > before.limit
    sharper = after.rms <= SHARPER * before.rms
    return bool((after.rms <= limit).all() and unexplained[:, at].any(axis=0).all()
                and (sharper | ~unexplained)[:, at].all())


def _rounding(record: Record, robot: Robot) -> np.ndarray:
    """RMS that the digits of the changed signals leave in the command, shape (n,)."""
    law = _replay_as_stated(record, robot).law
    size = np.sqrt(np.nanmean(record.signal("u") ** 2, axis=0))
    stated = np.zeros(record.n) if robot.encoder.resolution is None else robot.encoder.resolution
    step = np.array([step_size(record.q[:, k]) for k in range(record.n)])
    coarse = np.where(step > OTHER_STEP * stated, step, 0.0)
    of_position = ROUNDED_STEPS * coarse * law.position_gain()
    return np.maximum(ROUNDED_SHARE * size, np.minimum(of_position, MOST_ROUNDED * size))


def _start_error(records: Sequence[Record], robot: Robot) -> float:
    """Largest distance of a first position from the stated start, over the range of motion."""
    errors = [np.abs(record.q[0] - experiment.start).max() / np.ptp(record.q, axis=0).max()
              for k, record in enumerate(records)
              if (experiment := robot.experiments.get(f"log-{k + 1}")) is not None
              and experiment.start is not None]
    return float(max(errors, default=0.0))


def _correction(change: Change, robot: Robot) -> Correction:
    names = tuple(robot.joints[k] for k in change.joints)
    what = f"{change.what.format(joints=', '.join(names))}."
    return Correction(change.check, names, what, change.done,
                      "With this and nothing else the stated law reproduces the commands of every "
                      "log to their rounding.")


def _ambiguous(changes: Sequence[Change], robot: Robot) -> Finding:
    readings = "; or ".join(
        change.what.format(joints=", ".join(robot.joints[k] for k in change.joints))
        for change in changes)
    return Finding("error", "log.ambiguous", "The stated law does not reproduce the commands, "
                   f"but would after one change, and the logs leave open which: {readings}.",
                   "One correction mirrors or renames the robot of the other.",
                   "Correct the right one in the log; start_rad of the experiments in robot.toml "
                   "would decide it too.")


def _dead_channels(records: Sequence[Record], robot: Robot,
                   joints: Sequence[int]) -> list[Finding]:
    """Joints whose position stands still while their controller fights a motion."""
    return [Finding("error", "signal.dead", "Its position never changes, but the commands of its "
                    "controller do not follow from a position that rests.", "The channel is dead, "
                    "so the log says nothing of this joint.",
                    "Look at its cable and its column; log it again, or diagnose the other joints "
                    "from a log and a robot.toml without this one.", joint=robot.joints[k])
            for k in joints if all(k in dead_joints(record, robot) for record in records)]
