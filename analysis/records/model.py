"""The one form that every log is brought into: a `Record`, and the `Robot` that made it.

A record keeps what was measured: samples that cannot be used are marked in `valid`, never filled
in, and every guess or repair is a sentence in `decisions`.
"""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from clie_blocks.analysis.records.fields import FixedDict, check_name
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.errors import RecordError, nearest, visible

__all__ = ["SIGNALS", "Record", "Robot"]

SIGNALS = {
    "q": "measured joint position",
    "u": "command of the controller",
    "qd": "reference position",
    "pe": "injected excitation",
    "dq": "measured joint velocity",
    "tau": "measured or estimated joint torque",
    "q_motor": "position that a second encoder measures, on the motor",
}
SUPPLY = "supply"
CHANNELS = {SUPPLY: "supply voltage of the drives"}  # one per robot, kept in `Record.extra`
MEANINGS = {"time": "the clock", **SIGNALS, **CHANNELS}
WHERE_FINITE: Any = None  # default of a mask that is worked out when the record is built
DEFAULT_UNITS = {"time": "s", "q": "rad", "u": "N m", "qd": "rad", "pe": "N m", "dq": "rad/s",
                 "tau": "N m", "q_motor": "rad", SUPPLY: "V"}


@dataclasses.dataclass(frozen=True, eq=False)
class Record:
    """One measured run of a robot with n joints and N samples; arrays are read-only.

    Parameters
    ----------
    time : array_like, shape (N,)
        Stamps [s] as logged; they may repeat, jump or run backwards.
    q : array_like, shape (N, n)
        Measured joint position [rad, or m for a sliding joint].
    u : array_like, shape (N, n), optional
        Command of the controller, motor side [N m, or what `units` says]; None when not logged.
    qd, pe, dq, tau : array_like, shape (N, n), optional
        Reference [as q], injected excitation [as u], measured velocity, measured torque [N m].
    q_motor : array_like, shape (N, n), optional
        Position of the motors, of the joint or times the gear ratio, where `q` is that of the
        links [rad]; see `two_encoders`.
    valid : array_like of bool, shape (N,), optional
        False where a sample must not be used; by default where a value of q or u is not finite.
    joints : sequence of str, optional
        Names, unique; by default ``joint1, joint2, ...``.
    units : mapping, optional
        Unit of a signal, or one unit per joint; what is left out is SI with rad and N m.
    source : str
        Where the record came from: a file, and the part of it.
    decisions : sequence of str
        What the reader guessed, converted, repaired or left out, one sentence each.
    segments : sequence of (int, int), optional
        Half-open sample ranges between gaps; by default one that holds all samples.
    extra : mapping, optional
        Further channels by name, shape (N,) or (N, n), such as those of `CHANNELS`.
    robot : Robot, optional
        The robot that made it, where known.

    Raises
    ------
    RecordError
        If shapes, names or ranges do not fit together, or the record is empty.

    """

    time: np.ndarray
    q: np.ndarray
    u: np.ndarray | None = None
    qd: np.ndarray | None = None
    pe: np.ndarray | None = None
    dq: np.ndarray | None = None
    tau: np.ndarray | None = None
    q_motor: np.ndarray | None = None
    valid: np.ndarray = WHERE_FINITE
    joints: tuple[str, ...] = ()
    units: Mapping[str, str | Sequence[str]] = dataclasses.field(default_factory=FixedDict)
    source: str = ""
    decisions: Sequence[str] = ()
    segments: Sequence[tuple[int, int]] = ()
    extra: Mapping[str, np.ndarray] = dataclasses.field(default_factory=FixedDict)
    robot: Robot | None = None

    def __post_init__(self) -> None:
        self._put("time", self._floats("time", self.time, 1))
        self._put("q", self._floats("q", self.q, 2))
        for name in SIGNALS:
            value = getattr(self, name)
            if name != "q" and value is not None:
                self._put(name, self._floats(name, value, 2, (len(self), self.n)))
        if self.robot is not None and self.robot.n != self.n:
            self._fail(f"has {self.n} joints, its robot has {self.robot.n}; check that this "
                       "robot.toml belongs to the log")
        if len(self) == 0:
            self._fail("has no samples; without samples nothing can be learned: check the export")
        if self.q.shape[0] != len(self):
            self._fail(f"has {len(self)} stamps but {self.q.shape[0]} positions")
        if not np.isfinite(self.time).all():
            self._fail("has stamps that are NaN or infinite; drop those rows")
        self._put("joints", self._names())
        self._put("units", self._all_units())
        self._put("valid", self._mask())
        self._put("segments", self._ranges())
        self._put("source", visible(self.source))
        self._put("decisions", tuple(map(visible, self.decisions)))
        self._put("extra", FixedDict({name: self._extra(name, value)
                                      for name, value in dict(self.extra).items()}))

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a pickled record; pickling forgets that arrays are read-only."""
        self.__dict__.update(state)
        for array in (*state.values(), *state["extra"].values()):
            if isinstance(array, np.ndarray):
                array.flags.writeable = False

    def __len__(self) -> int:
        return self.time.size

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.shape[1]

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that were logged, in the order of `SIGNALS`."""
        return tuple(name for name in SIGNALS if getattr(self, name) is not None)

    def signal(self, name: str) -> np.ndarray:
        """Return a signal that must have been logged, shape (N, n)."""
        value: np.ndarray | None = getattr(self, name)
        if value is None:
            self._fail(f"has no {SIGNALS[name]} {name}; log {name} too")
        return value

    @property
    def duration(self) -> float:
        """Time from the first to the last stamp [s]."""
        return float(self.time[-1] - self.time[0])

    @functools.cached_property
    def sample_time(self) -> float:
        """Median of the positive steps of the clock [s]; NaN when there is none."""
        step = np.diff(self.time)
        step = step[step > 0]
        return float(np.median(step)) if step.size else float("nan")

    def replace(self, **changes: Any) -> "Record":
        """Return a copy with some fields changed, checked again."""
        return dataclasses.replace(self, **changes)

    def noted(self, *sentences: str) -> "Record":
        """Return a copy with sentences added to `decisions`."""
        return self.replace(decisions=(*self.decisions, *sentences))

    def part(self, start: int, stop: int) -> "Record":
        """Return the samples ``start:stop``, counted from 0, as a record of their own."""
        cut = slice(start, stop)
        changes = {name: getattr(self, name)[cut] for name in ("time", "valid", *self.signals)}
        ranges = [(max(a, start) - start, min(b, stop) - start) for a, b in self.segments]
        return self.replace(segments=[(a, b) for a, b in ranges if b > a],
                            extra={name: value[cut] for name, value in self.extra.items()},
                            **changes)

    def rows(self, chosen: np.ndarray) -> "Record":
        """Return the samples that a mask of shape (N,) chooses; segments stay where they are."""
        counts = np.concatenate([[0], np.cumsum(chosen)])
        return self.replace(
            segments=[(counts[a], counts[b]) for a, b in self.segments if counts[b] > counts[a]],
            extra={name: value[chosen] for name, value in self.extra.items()},
            **{name: getattr(self, name)[chosen] for name in ("time", "valid", *self.signals)})

    def joint(self, which: str | int) -> int:
        """Return the index of a joint by its name or its number from 0."""
        if which in self.joints:
            return self.joints.index(which)
        if isinstance(which, int) and 0 <= which < self.n:
            return which
        raise RecordError(f"{self.source or 'record'} has no joint {which!r}; "
                          f"{nearest(which, self.joints)}")

    def of_robot(self, robot: Robot) -> "Record":
        """Return the record with its robot, joints in the robot's order."""
        named = robot.joints != tuple(f"joint{k + 1}" for k in range(robot.n))
        if not named or self.joints == robot.joints:
            return self.replace(robot=robot)
        if set(self.joints) != set(robot.joints):
            unknown = sorted(set(self.joints) - set(robot.joints)) or self.joints
            self._fail(f"has a joint {unknown[0]!r} that its robot does not have; "
                       f"{nearest(unknown[0], robot.joints)}")
        return self.of_joints(robot.joints).replace(robot=robot)

    def of_joints(self, names: Sequence[str]) -> "Record":
        """Return the record of some joints, in the order of their names, without a robot."""
        order = [self.joint(name) for name in names]
        changes = {name: getattr(self, name)[:, order] for name in self.signals}
        units = {name: tuple(self.units[name][k] for k in order) for name in SIGNALS}
        extra = {name: value[:, order] if value.shape[1:] == (self.n,) else value
                 for name, value in self.extra.items()}
        return self.replace(joints=tuple(names), robot=None, units=units, extra=extra, **changes)

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _fail(self, what: str) -> NoReturn:
        raise RecordError(f"{self.source or 'record'} {what}")

    def __repr__(self) -> str:
        logged = ", ".join(self.signals)
        return (f"Record({self.source!r}: {len(self)} samples, {self.duration:.6g} s, "
                f"{self.n} joints, {logged})")

    def _floats(self, name: str, value: Any, ndim: int,
                shape: tuple[int, int] | None = None) -> np.ndarray:
        try:
            array = read_only(value)
        except (TypeError, ValueError):
            self._fail(f"has a {name} that is not numeric")
        if ndim == 2 and array.ndim == 1:
            array = array[:, None]
        if array.ndim != ndim or (ndim == 2 and array.shape[1] == 0):
            wanted = "(N,)" if ndim == 1 else "(N, n)"
            self._fail(f"has a {name} of shape {array.shape}, wanted {wanted}")
        if shape is not None and array.shape != shape:
            self._fail(f"has a {name} of shape {array.shape}, but N x n is {shape}")
        return array

    def _names(self) -> tuple[str, ...]:
        names = tuple(str(name) for name in self.joints)
        names = names or tuple(f"joint{k + 1}" for k in range(self.n))
        if len(names) != self.n:
            self._fail(f"has {self.n} joints but {len(names)} names: {', '.join(names)}; name "
                       "each joint once")
        for name in names:
            check_name(name, f"{self.source or 'record'}: the joint name")
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            self._fail(f"names more than one joint {twice[0]!r}; every joint needs its own name")
        return names

    def _all_units(self) -> FixedDict:
        stated = dict(self.units)
        unknown = [name for name in stated if name not in DEFAULT_UNITS]
        if unknown:
            self._fail(f"gives a unit of {unknown[0]!r}; {nearest(unknown[0], DEFAULT_UNITS)}")
        return FixedDict({name: self._unit(name, stated.get(name, unit))
                          for name, unit in DEFAULT_UNITS.items()})

    def _unit(self, name: str, unit: str | Sequence[str]) -> str | Sequence[str]:
        if name == "time":
            return unit
        units = (unit,) * self.n if isinstance(unit, str) else tuple(unit)
        if len(units) != self.n:
            self._fail(f"has {self.n} joints but {len(units)} units of {name}")
        return units

    def _mask(self) -> np.ndarray:
        if self.valid is None:
            valid = np.isfinite(self.q).all(axis=1)
            if self.u is not None:
                valid &= np.isfinite(self.u).all(axis=1)
        else:
            valid = np.array(self.valid, bool)
        if valid.shape != (len(self),):
            self._fail(f"has {len(self)} samples but a mask of shape {valid.shape}")
        valid.flags.writeable = False
        return valid

    def _ranges(self) -> tuple[tuple[int, int], ...]:
        ranges = tuple((int(a), int(b)) for a, b in self.segments) or ((0, len(self)),)
        ends = [edge for pair in ranges for edge in pair]
        if ends != sorted(ends) or ends[0] < 0 or ends[-1] > len(self):
            self._fail(f"has segments that do not lie in order within {len(self)} samples")
        return ranges

    def _extra(self, name: str, value: Any) -> np.ndarray:
        array = read_only(value)
        if array.ndim not in (1, 2) or array.shape[0] != len(self):
            self._fail(f"has a channel {name!r} of shape {array.shape} with {len(self)} samples")
        return array


def read_only(value: Any) -> np.ndarray:
    """Return a read-only float array; one that is read-only already is not copied."""
    if isinstance(value, np.ndarray) and value.dtype == float and not value.flags.writeable:
        return value
    array = np.array(value, float)
    array.flags.writeable = False
    return array
