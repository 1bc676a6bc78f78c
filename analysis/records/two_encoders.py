"""Logs of two encoders, one on the motor and one on the link: which is which, and on which side.

The file says on which of them the law acts, ``[encoder] mounting``; without it, on that of the
link.  What the law acts on is `Record.q` from then on, as in a log of one encoder, and the other
one goes with it as a further channel.
"""

from collections.abc import Sequence
from typing import NoReturn

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import RecordError

OTHER = "q of the other encoder"
ALIKE = 1.1  # factor between two motions that are the same, but for a soft gear
PLAY = 1.5  # factor between two motions, of which play and a soft gear make one larger
NOT_OF_PLAY = 0.5  # of what a factor changes, that is left beside it: less, it is one of units
LEAST_KNOWN = 0.9  # share of the samples of the motors, below which they are left out
LEAST_MOTION = 1e-9  # rad, of a joint that moves


def other_encoder(record: Record) -> np.ndarray | None:
    """Positions of the encoder on which the law does not act, shape (N, n) [as q], or None."""
    return record.extra.get(OTHER)


def with_law_encoder(records: Sequence[Record], robot: Robot) -> tuple[Record, ...]:
    """Return the logs of a robot with `q` of the encoder on which the law acts.

    Parameters
    ----------
    records : sequence of Record
        Logs; those that hold `q_motor` are changed.
    robot : Robot
        Gear ratio, and mounting of the encoder on which the law acts.

    Raises
    ------
    RecordError
        If the motors move neither as far as the joints nor by the gear ratio further.

    """
    known = [record for record in records if record.q_motor is not None]
    if not known:
        return tuple(records)
    of_joint, sentence = _joint_per_motor(known, robot)
    return tuple(record if record.q_motor is None
                 else _one_first(record, robot, of_joint, sentence) for record in records)


def _one_first(record: Record, robot: Robot, of_joint: np.ndarray, sentence: str) -> Record:
    """Record with the positions of the law's encoder as q, and the other ones beside them."""
    motor, link = record.signal("q_motor") * of_joint, record.q
    is_known = np.isfinite(motor).all(axis=1)
    record = record.replace(q_motor=None)
    on_motor = robot.encoder.mounting == "motor side"
    if is_known[record.valid].mean() < LEAST_KNOWN:
        if on_motor:
            raise RecordError(
                f"{record.source}: q_motor is missing in more than a tenth of the samples, and by "
                "mounting = \"motor side\" the law acts on it; log it in each, or leave it out "
                "if q is what the law sees")
        return record.noted("Left out q_motor: it is missing in more than a tenth of the samples.")
    acts = "The law acts on {}, and {} is predicted beside it.".format(
        *(("q_motor", "q") if on_motor else ("q", "q_motor")))
    first, other = (motor, link) if on_motor else (link, motor)
    return record.replace(q=first, valid=record.valid & is_known,
                          extra={**record.extra, OTHER: other}).noted(sentence, acts)


def _joint_per_motor(records: Sequence[Record], robot: Robot) -> tuple[np.ndarray, str]:
    """Factor from q_motor to the joint's side, shape (n,), and the sentence that says so."""
    slope, beside = _motor_per_joint(records)
    sides = {"joint side": np.ones(robot.n)}
    if robot.motor.gear_ratio is not None:
        sides["motor side"] = robot.motor.gear_ratio
    moved = np.isfinite(slope)
    off = {side: np.abs(np.log(np.abs(slope[moved]) / factor[moved]))
           for side, factor in sides.items()}
    side = min(off, key=lambda one: off[one].sum())
    changed = np.abs(np.abs(slope[moved]) - sides[side][moved])
    is_play = beside[moved] > NOT_OF_PLAY * changed
    wrong = off[side] > np.where(is_play, np.log(PLAY), np.log(ALIKE))
    if wrong.any():
        k = int(np.flatnonzero(moved)[np.argmax(np.where(wrong, off[side], 0.0))])
        _refuse(records[0], robot, k, float(slope[k]))
    turned = np.where(moved, np.sign(slope), 1.0)
    sentence = f"q_motor is in angles of the {side.removesuffix(' side')}"
    if (turned < 0).any():
        against = ", ".join(name for name, sign in zip(robot.joints, turned) if sign < 0)
        sentence += f", and turns against q at {against}"
    return turned / sides[side], f"{sentence}, by how far it moves."


def _motor_per_joint(records: Sequence[Record]) -> tuple[np.ndarray, np.ndarray]:
    """Slope of q_motor over q of each joint, over all records, and what it leaves per motion of q.

    Both are NaN of a joint that does not move.
    """
    product, square, of_motor = (np.zeros(records[0].n) for _ in range(3))
    for record in records:
        motor = record.signal("q_motor")
        rows = record.valid & np.isfinite(motor).all(axis=1)
        if rows.any():
            q, motor = (one[rows] - one[rows].mean(axis=0) for one in (record.q, motor))
            product, square = product + (q * motor).sum(axis=0), square + (q**2).sum(axis=0)
            of_motor = of_motor + (motor**2).sum(axis=0)
    moves = square > LEAST_MOTION**2
    square = np.where(moves, square, 1.0)
    slope = np.where(moves, product, np.nan) / square
    return slope, np.sqrt(np.maximum(of_motor / square - slope**2, 0.0))


def _refuse(record: Record, robot: Robot, k: int, slope: float) -> NoReturn:
    ratio = robot.motor.gear_ratio
    stated = "no gear_ratio is stated" if ratio is None else f"gear_ratio is {ratio[k]:g}"
    raise RecordError(
        f"{record.source}: q_motor of {robot.joints[k]} moves {slope:.4g} times as far as q, and "
        f"{stated}: it is an angle neither of the joint nor of the motor. State its unit in the "
        "header, as q_motor1[deg], correct [motor] gear_ratio, or leave the column out")
