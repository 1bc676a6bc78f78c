"""What the stated control law proves of logs: whether they are its own, or after one change.

Replayed on the logged positions the law gives the logged commands to their rounding.  Where it
does so only after one change of the signals, on all logs of a robot, the recorder did just that.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks.law import (
    EXPLAINED,
    explained_rms,
    law_parts,
    replay_unsaturated,
)
from clie_blocks.analysis.records.checks.measures import step_size
from clie_blocks.analysis.records.checks.scale import FAR, NEAR, inertia_ratios
from clie_blocks.analysis.records.control_law import stated_variant
from clie_blocks.analysis.records.law_residual import ROUNDED_SHARE, ROUNDED_STEPS
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import Replay, sample_time, variants, velocity
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.single_changes import Change, single_changes, start_offsets

OTHER_STEP = 1.5  # times the stated step of the position: it was rounded once more in the log
MOST_ROUNDED = 0.05  # of the command's RMS that rounding of the logged position may explain
PIECE = 1500  # samples of each log that refute a change before it is tried on all
LAX = 3.0  # times the limit, above which a piece refutes it
BETTER = 0.95  # of the squares, below which another explanation leaves clearly less
AWAY = 0.02  # of the range of motion, from the stated start, at which a log begins elsewhere


@dataclasses.dataclass(frozen=True, eq=False)
class Misfit:
    """What a law leaves of the commands, and what of that their rounding explains.

    Parameters
    ----------
    rms, limit : ndarray, shape (logs, n)
        RMS of the one and of the other [unit of u].

    """

    rms: np.ndarray
    limit: np.ndarray


def law_misfit(records: Sequence[Record], robot: Robot) -> Misfit:
    """What the stated law leaves of the commands of some logs."""
    rows = [_law_misfit_of(record, robot) for record in records]
    return Misfit(np.array([rms for rms, _ in rows]), np.array([limit for _, limit in rows]))


def _law_misfit_of(record: Record, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Misfit of each joint in the part of the log in which it is worst, and its limit."""
    rows = []
    for part in law_parts(record):
        replayed = replay_as_stated(part, robot)
        rows.append((replayed.rms, explained_rms(part, robot, replayed)))
    rms, limit = (np.array(values) for values in zip(*rows, strict=True))
    worst = np.argmax(rms / np.maximum(limit, np.finfo(float).tiny), axis=0)[None]
    return np.take_along_axis(rms, worst, 0)[0], np.take_along_axis(limit, worst, 0)[0]


def replay_as_stated(record: Record, robot: Robot) -> Replay:
    """Replay of the stated law with its stated velocity filter."""
    return replay_unsaturated(record, robot, stated_variant(robot.controller))


def is_explained_by_another_filter(records: Sequence[Record], robot: Robot) -> bool:
    """Whether the law explains every log with another velocity filter: a matter of the file."""
    return all((replayed.rms <= explained_rms(part, robot, replayed)).all()
               for record in records for part in law_parts(record)
               for replayed in [replay_unsaturated(part, robot)])


def proven_changes(records: tuple[Record, ...], robot: Robot, joints: Sequence[int],
                    before: Misfit) -> list[tuple[Change, tuple[Record, ...]]]:
    """Changes after which the law explains all logs, with the changed logs.

    Of changes that explain the logs alike, those count that agree with what the robot file says of
    the positions; and one by a unit before one by a number that no unit has.
    """
    proven, pieces = [], [_middle(record) for record in records]
    heads = [law_parts(record)[0] for record in records]
    for change in single_changes(heads, robot, joints, _variant(heads[0], robot)):
        if not _may_explain(change, pieces, robot):
            continue
        changed = tuple(change.apply(record) for record in records)
        if (_is_proof(law_misfit(changed, robot), before, changed, robot, change.joints)
                and (not change.unweighed or _is_weighed(records, changed, robot))
                and not _is_rather_its_velocity(records, changed, robot, change.joints)):
            proven.append((change, changed))
    if len(proven) < 2:
        return proven
    errors = [_disagreement(changed, robot) for _, changed in proven]
    agreeing = [pair for pair, error in zip(proven, errors, strict=True)
                if error <= max(min(errors), AWAY)]
    return [pair for pair in agreeing if not pair[0].unnamed] or agreeing


def _is_rather_its_velocity(before: Sequence[Record], after: Sequence[Record], robot: Robot,
                            joints: Sequence[int]) -> bool:
    """Whether a law that takes the velocity of the reference explains more than its shift does.

    A law that leads looks as if its reference were late: q_d + lead dq_d/dt is nearly q_d at a
    later time.  Where the two are equal the change counts.
    """
    moved = [(one, other) for one, other in zip(before, after, strict=True)
             if one.qd is not None and one.qd is not other.qd]
    if not moved:
        return False
    shifted = sum(float((replay_as_stated(other, robot).rms[list(joints)]**2).sum())
                  for _, other in moved)
    led = sum(_left_by_lead(one, robot, k) for one, _ in moved for k in joints)
    return led < BETTER * shifted


def _left_by_lead(record: Record, robot: Robot, k: int) -> float:
    """Mean square that the law leaves of a command, beside the velocity of the reference."""
    law, reference = replay_as_stated(record, robot), record.signal("qd")
    rate = np.gradient(reference[:, k], sample_time(record, robot.controller))
    filtered = velocity(record.replace(q=reference), robot.controller, law.variant, k)[:, 0]
    columns = np.stack([rate, filtered], axis=1)
    used = law.used & np.isfinite(columns).all(axis=1)
    residual, columns = law.residual[used, k], columns[used]
    left = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    return float(np.mean(left**2))


def _is_weighed(before: Sequence[Record], after: Sequence[Record], robot: Robot) -> bool:
    """Whether the stated inertia contradicts the torques before a change, and not after it."""
    was, found = (np.array([inertia_ratios(record, robot) for record in records])
                  for records in (before, after))
    known = (was > 0) & (found > 0)
    if not known.any():
        return False
    was, found = np.abs(np.log(was[known])), np.abs(np.log(found[known]))
    return bool((was > np.log(FAR)).all() and np.median(found) < np.log(NEAR))


def _middle(record: Record) -> Record:
    """A piece of a record that is long enough to refute a change."""
    start = max(0, (len(record) - PIECE) // 2)
    return record.part(start, min(start + PIECE, len(record)))


def _may_explain(change: Change, pieces: Sequence[Record], robot: Robot) -> bool:
    """Whether the middle of every log agrees with a change; a piece refutes most of them."""
    for piece in pieces:
        changed = change.apply(piece)
        after, size = law_misfit([changed], robot), np.nanstd(changed.signal("u"), axis=0)
        if (after.rms > np.maximum(LAX * after.limit, LAX * MOST_ROUNDED * size)).any():
            return False
    return True


def _variant(record: Record, robot: Robot) -> str | None:
    """Velocity filter to look for a change with: the stated one, else that which fits best."""
    stated = stated_variant(robot.controller)
    if stated in variants(record, robot.controller):
        return stated
    return replay_unsaturated(record, robot).variant


def _is_proof(after: Misfit, before: Misfit, changed: Sequence[Record], robot: Robot,
              joints: Sequence[int]) -> bool:
    """Whether every joint is explained on every log, and those changed are so much better."""
    limit = np.maximum(after.limit, [_rounding(record, robot) for record in changed])
    at = list(joints)
    unexplained = before.rms > before.limit
    sharper = after.rms <= EXPLAINED * before.rms
    return bool((after.rms <= limit).all() and unexplained[:, at].any(axis=0).all()
                and (sharper | ~unexplained)[:, at].all())


def _rounding(record: Record, robot: Robot) -> np.ndarray:
    """RMS that the digits of the changed signals leave in the command, shape (n,)."""
    law = replay_as_stated(record, robot).law
    size = np.sqrt(np.nanmean(record.signal("u") ** 2, axis=0))
    stated = np.zeros(record.n) if robot.encoder.resolution is None else robot.encoder.resolution
    step = np.array([step_size(record.q[:, k]) for k in range(record.n)])
    coarse = np.where(step > OTHER_STEP * stated, step, 0.0)
    of_position = ROUNDED_STEPS * coarse * law.position_gain()
    return np.maximum(ROUNDED_SHARE * size, np.minimum(of_position, MOST_ROUNDED * size))


def _disagreement(records: Sequence[Record], robot: Robot) -> float:
    """How much the logs contradict what the file states of positions: 1 where they do clearly.

    The largest distance of a first position from the stated start, over the range of motion; and
    the step of the encoder, where the positions lie on a lattice.
    """
    offsets = start_offsets(records, robot)
    ranges = np.array([np.ptp(record.q, axis=0).max() for record in records])
    error = 0.0 if offsets is None else float((np.abs(offsets).max(axis=1) / ranges).max())
    stated = robot.encoder.resolution
    if stated is None:
        return error
    steps = np.array([[step_size(record.q[:, k]) for k in range(robot.n)] for record in records])
    apart = np.abs(np.log(steps / np.where(stated > 0, stated, np.nan)))
    return max(error, float(np.nanmax(apart, initial=0.0) > np.log(OTHER_STEP)))
