"""Logs of a joint whose output was locked: the twist of its gear under a torque that ramps.

Nothing moves but the motor, by the lost motion and the twist of the gear.  So the log shows both
by themselves, without a model of the motion: how far the motor goes while its torque hardly
changes, and what torque it takes for each angle on the way to the largest torque and back.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records import Record, Robot
from clie_blocks.errors import NotIdentifiableError

LOCKED = "locked"  # verdict on a robot of which all logs are so
WINDOW = 0.1  # of the torque range of a sweep, within which lost motion lies
LOADED = 0.25  # of the largest torque of a sweep, beyond which its gear is loaded
LARGE = 0.5  # of the largest torque of all sweeps: those beyond show the stiffness
LEAST_SWEEP = 0.05  # of the largest torque, on either side, that makes a sweep
AT_EXTREME = 0.97  # of the largest torque, from which on a torque is at its limit


@dataclasses.dataclass(frozen=True)
class Twist:
    """Twist of a gear behind a locked output, joint side.

    Parameters
    ----------
    log, joint : str
        Where it was measured.
    lost_motion : tuple of float
        Quartiles and median over the sweeps [rad]: low, median, high.
    stiffness : tuple of float
        While the torque grows, and while it falls [N m/rad].
    breakaway : float
        Torque that turns the motor through the lost motion [N m].
    sweeps : int
        Number of sweeps from one direction of the torque to the other.

    """

    log: str
    joint: str
    lost_motion: tuple[float, float, float]
    stiffness: tuple[float, float]
    breakaway: float
    sweeps: int

    def to_dict(self) -> dict[str, Any]:
        """Entry of the JSON answer."""
        low, median, high = self.lost_motion
        return {"log": self.log, "joint": self.joint, "sweeps": self.sweeps,
                "lost_motion": {"value": median, "interval": [low, high], "unit": "rad"},
                "stiffness": {"value": list(self.stiffness), "unit": "N m/rad"},
                "breakaway": {"value": self.breakaway, "unit": "N m"}}


class LockedError(NotIdentifiableError):
    """The output was locked in all logs, so that nothing moved but the gears."""

    def __init__(self, found: Sequence[Twist]) -> None:
        super().__init__("the output was locked in all logs, so that no motion can be explained: "
                         "add a log with a free output; 'clie diagnose' says how the gears twist")
        self.twists = tuple(found)


def is_locked(record: Record, robot: Robot) -> bool:
    """Whether the robot file says that the output was locked in a log."""
    stated = robot.experiments.get(Path(record.source).name.partition(".")[0])
    return bool(robot.nominal.output_locked or (stated is not None and stated.output_locked))


def twists(record: Record) -> list[Twist]:
    """Twist of every joint whose torque ramps to both sides.

    Raises
    ------
    NotIdentifiableError
        If no torque is logged, or none changes its sign twice.

    """
    torques = record.tau if record.tau is not None else record.u
    if torques is None:
        raise NotIdentifiableError(f"{record.source}: the output was locked and no torque is "
                                   "logged, so that its twist says nothing: log the torque")
    found = [_twist(record, k, record.q[record.valid, k], torques[record.valid, k])
             for k in range(record.n) if np.ptp(torques[record.valid, k]) > 0.0]
    known = [twist for twist in found if twist is not None]
    if not known:
        raise NotIdentifiableError(f"{record.source}: the output was locked, and no torque goes "
                                   "from one direction to the other: ramp it up and down through "
                                   "zero, three times or more")
    return known


def _twist(record: Record, k: int, q: np.ndarray, torque: np.ndarray) -> Twist | None:
    known = np.isfinite(q) & np.isfinite(torque)
    q, torque = q[known], torque[known]
    sweeps = _sweeps(torque)
    if not sweeps:
        return None
    largest = float(np.abs(torque).max())
    stiff = [pair for a, b in sweeps if np.abs(torque[a:b]).max() > LARGE * largest
             for pair in _secants(q[a:b], torque[a:b])]
    growing, falling = (float(np.median([pair[i] for pair in stiff])) for i in (0, 1))
    lost, at = zip(*(_lost_motion(q[a:b], torque[a:b], growing) for a, b in sweeps))
    low, median, high = np.quantile(lost, [0.25, 0.5, 0.75]).tolist()
    return Twist(record.source, record.joints[k], (low, median, high), (growing, falling),
                 float(np.median(np.abs(at))), len(sweeps))


def _sweeps(torque: np.ndarray) -> list[tuple[int, int]]:
    """Ranges of samples from the largest torque of one direction to that of the other, and on.

    A sweep ends where the torque has come back to zero, so that it holds both secants.
    """
    least = LEAST_SWEEP * np.abs(torque).max()
    side = np.where(torque > least, 1, np.where(torque < -least, -1, 0))
    loaded = np.flatnonzero(side)
    starts = loaded[np.flatnonzero(np.diff(side[loaded]))]  # last of one side before the other
    ends = [*starts[1:].tolist(), len(torque)]
    return [(int(a), int(b)) for a, b in zip(starts.tolist(), ends)]


def _secants(q: np.ndarray, torque: np.ndarray) -> list[tuple[float, float]]:
    """Torque per angle of one sweep while the torque grows, and while it falls [N m/rad]."""
    size = np.abs(torque)
    at_extreme = np.flatnonzero(size >= AT_EXTREME * size.max())
    first, last = at_extreme[0], at_extreme[-1]
    before = np.flatnonzero(size[:first] <= LOADED * size.max())
    behind = np.flatnonzero(size[last:] <= LOADED * size.max())
    if not before.size or not behind.size:
        return []
    start, stop = before[-1], last + behind[0]
    growing = (torque[first] - torque[start]) / (q[first] - q[start] or np.inf)
    falling = (torque[last] - torque[stop]) / (q[last] - q[stop] or np.inf)
    return [(abs(float(growing)), abs(float(falling)))]


def _lost_motion(q: np.ndarray, torque: np.ndarray, stiffness: float) -> tuple[float, float]:
    """Largest travel within a window of the torque, beyond twist, and the torque there."""
    way = np.sign(torque[np.argmax(np.abs(torque))])
    until = int(np.argmax(way * torque)) + 1
    q, along = way * q[:until], np.maximum.accumulate(way * torque[:until])
    width = WINDOW * (along[-1] - along[0])
    behind = np.searchsorted(along, along + width, side="right") - 1
    travel = q[behind] - q
    best = int(np.argmax(travel))
    taken = (along[behind[best]] - along[best]) / stiffness
    return float(max(travel[best] - taken, 0.0)), float(along[best] + width / 2)
