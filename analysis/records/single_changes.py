"""Changes of a log, one fault of recording each, that may make the stated law reproduce it.

A log whose commands follow from its other signals by the stated law is proven.  Where they do not,
but do after exactly one of these changes, to their rounding and on every log, that change is
proven too: no fault of a robot turns a command by -1 or makes an angle 57.3 times as large.
"""

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import sample_time, velocity
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.units import DEGREE, TURN

ANGLE_UNITS = {"degrees": DEGREE, "turns": TURN, "mrad": 1e-3}
MOST_PERMUTED = 4  # joints of which every order is tried; of more, every exchange of two
LONGEST_LAG = 0.25  # s, of one channel behind the others
WORDS = {"q": "position q", "qd": "reference qd", "u": "command u", "pe": "excitation pe"}


@dataclasses.dataclass(frozen=True, eq=False)
class Change:
    """One change of a log.

    Parameters
    ----------
    check : str
        Stable name, ``family.fault``, as of a `Finding`.
    joints : tuple of int
        Joints whose signals it changes.
    what : str
        What the log then has been, a clause with ``{joints}`` in it.
    done : str
        What was done about it, a sentence.
    apply : callable
        From a record to the changed record.

    """

    check: str
    joints: tuple[int, ...]
    what: str
    done: str
    apply: Callable[[Record], Record]


def single_changes(records: Sequence[Record], robot: Robot, joints: Sequence[int],
                   variant: str | None) -> Iterator[Change]:
    """Changes of the signals of some joints, of which each is one fault of recording."""
    chosen = tuple(joints)
    live = _live_signals(records)
    yield from _angle_units(chosen, live)
    yield from _torque_units(robot, chosen, live)
    yield from _signs(chosen, live)
    yield from _orders(robot, chosen, live)
    yield from _lags(records, robot, chosen, live, variant)
    yield from _reference_velocity(robot, chosen, live, variant)


def _live_signals(records: Sequence[Record]) -> frozenset[str]:
    """Signals of the law that are logged everywhere and not zero throughout."""
    return frozenset(name for name in ("q", "u", "qd", "pe")
                     if all(getattr(record, name) is not None for record in records)
                     and any(np.nanmax(np.abs(getattr(record, name)), initial=0.0) > 0
                             for record in records))


def _groups(live: frozenset[str], *groups: Sequence[str]) -> list[tuple[str, ...]]:
    """Groups of signals that are logged, each once."""
    return [tuple(group) for group in groups if live.issuperset(group)]


def scaled(record: Record, signals: Sequence[str], joints: Sequence[int],
           factors: np.ndarray) -> Record:
    """Record with signals of some joints multiplied by factors, shape (n,)."""
    factor = np.ones(record.n)
    factor[list(joints)] = factors[list(joints)]
    return record.replace(**{name: getattr(record, name) * factor for name in signals
                             if getattr(record, name) is not None})


def _scaling(check: str, what: str, signals: tuple[str, ...], joints: tuple[int, ...],
             factors: np.ndarray) -> Change:
    with_rate = (*signals, "dq") if "q" in signals else signals
    shown = ", ".join(dict.fromkeys(f"{factors[k]:.6g}" for k in joints))
    return Change(check, joints, what, f"Multiplied {_and(signals)} by {shown}.",
                  lambda record: scaled(record, with_rate, joints, factors))


def _angle_units(joints: tuple[int, ...], live: frozenset[str]) -> Iterator[Change]:
    for signals in _groups(live, ("q", "qd"), ("q",), ("qd",)):
        for unit, factor in ANGLE_UNITS.items():
            size = 1 + max(joints)
            yield _scaling("units.position", f"{_is_are(signals)} in {unit}", signals, joints,
                           np.full(size, factor))


def _torque_units(robot: Robot, joints: tuple[int, ...], live: frozenset[str],
                  ) -> Iterator[Change]:
    """Torques in another unit or on the other side of the gear, with or without excitation."""
    one, motor = np.ones(robot.n), robot.motor
    units = [("units.torque", "in mN m", 1e-3 * one)]
    if motor.peak_torque is not None:
        units += [("units.torque", "in percent of the peak torque", 0.01 * motor.peak_torque),
                  ("units.torque", "a share of the peak torque", motor.peak_torque)]
    if motor.torque_constant is not None:
        units += [("units.torque", "the current of the motor in A", motor.torque_constant)]
    ratio = motor.gear_ratio
    if ratio is not None and (ratio[list(joints)] != 1).any():
        units += [("torque.side", "on the joint side of the gear", 1 / ratio),
                  ("torque.side", "divided by the gear ratio once more", ratio)]
    for signals in _groups(live, ("u",), ("u", "pe"), ("pe",)):
        for check, what, factors in units:
            yield _scaling(check, f"{_is_are(signals)} {what}", signals, joints, factors)


def _signs(joints: tuple[int, ...], live: frozenset[str]) -> Iterator[Change]:
    for signals in _groups(live, ("u",), ("q",), ("qd",), ("pe",), ("u", "pe"), ("q", "qd")):
        yield dataclasses.replace(
            _scaling("signs", f"{_is_are(signals)} written with the opposite sign", signals,
                     joints, np.full(1 + max(joints), -1.0)), done=f"Turned {_and(signals)}.")


def _orders(robot: Robot, joints: tuple[int, ...], live: frozenset[str]) -> Iterator[Change]:
    """Columns of some joints in another order."""
    for signals in _groups(live, ("u",), ("q",), ("qd",), ("pe",), ("u", "pe"), ("q", "qd")):
        for order in _permutations(joints):
            whole = list(range(robot.n))
            for joint, source in zip(joints, order, strict=True):
                whole[joint] = source
            pairs = ", ".join(f"{robot.joints[k]} in the column of {robot.joints[j]}"
                              for k, j in enumerate(whole) if j != k)
            with_rate = (*signals, "dq") if "q" in signals else signals
            yield Change("order", tuple(k for k, j in enumerate(whole) if j != k),
                         f"{_is_are(signals)} swapped, that of {pairs}",
                         "Put the columns back in order.", _reordering(with_rate, whole))


def _permutations(joints: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    if len(joints) <= MOST_PERMUTED:
        yield from (order for order in itertools.permutations(joints) if order != joints)
        return
    for a, b in itertools.combinations(range(len(joints)), 2):
        order = list(joints)
        order[a], order[b] = order[b], order[a]
        yield tuple(order)


def _reordering(signals: Sequence[str], order: Sequence[int]) -> Callable[[Record], Record]:
    return lambda record: record.replace(**{
        name: getattr(record, name)[:, list(order)] for name in signals
        if getattr(record, name) is not None})


def _lags(records: Sequence[Record], robot: Robot, joints: tuple[int, ...],
          live: frozenset[str], variant: str | None) -> Iterator[Change]:
    """Channels that are a whole number of rows behind the others, or before them.

    A command that follows from the row before it is left to the check of the controller, which
    may compute in one cycle and send in the next.
    """
    for signals in _groups(live, ("q",), ("qd",), ("pe",), ("u",)):
        lively = max(records, key=lambda record: float(np.nanstd(record.signal(signals[0]))))
        parts = _parts_of_law(lively, robot, variant)
        late = {_lag_of(parts, signals[0], k, lively.sample_time) for k in joints}
        rows = late.pop() if len(late) == 1 else 0
        if rows == 0 or (signals == ("u",) and rows == 1):
            continue
        side, shift = ("late", "earlier") if rows > 0 else ("early", "later")
        count = f"{abs(rows)} row{'s' if abs(rows) > 1 else ''}"
        yield Change("lag", joints, f"{_is_are(signals)} logged {count} too {side}",
                     f"Moved {_and(signals)} {count} {shift}.",
                     _shifting(signals, joints, rows))


def _parts_of_law(record: Record, robot: Robot, variant: str | None) -> dict[str, np.ndarray]:
    """What each signal contributes to ``kp qd - (kp q + kd v) + pe - u``, 0 by the law."""
    law = control_law(robot.controller, sample_time(record, robot.controller), variant)
    rate = velocity(record, robot.controller, law.variant)
    parts = {"q": -(law.kp * record.q + law.kd * rate), "u": -record.signal("u"),
             "qd": law.kp * record.signal("qd"),
             "pe": np.zeros_like(record.q) if record.pe is None else record.pe}
    return {name: np.where(np.isfinite(part), part, 0.0) for name, part in parts.items()}


def _lag_of(parts: dict[str, np.ndarray], name: str, k: int, step: float) -> int:
    """Rows by which a signal of joint k lags behind the others: where they agree best."""
    own = parts[name][:, k]
    others = -sum(part[:, k] for other, part in parts.items() if other != name)
    reach = min(round(LONGEST_LAG / step), len(own) // 4)
    size = 1 << (len(own) + reach).bit_length()
    product = np.fft.irfft(np.fft.rfft(own, size) * np.conj(np.fft.rfft(others, size)), size)
    lags = np.arange(-reach, reach + 1)
    of_own, of_others = (np.concatenate(([0.0], np.cumsum(x**2))) for x in (own, others))
    first, last = np.maximum(lags, 0), len(own) + np.minimum(lags, 0)
    energy = of_own[last] - of_own[first] + of_others[last - lags] - of_others[first - lags]
    return int(lags[np.argmin((energy - 2 * product[lags]) / (last - first))])


def _shifting(signals: Sequence[str], joints: tuple[int, ...],
              rows: int) -> Callable[[Record], Record]:
    """Change that moves signals by so many rows, and cuts the rows that then lack one of them."""
    def shift(record: Record) -> Record:
        moved = {name: getattr(record, name).copy() for name in signals}
        for x in moved.values():
            x[:, list(joints)] = np.roll(x[:, list(joints)], -rows, axis=0)
        return record.replace(**moved).part(max(-rows, 0), len(record) - max(rows, 0))
    return shift


def _reference_velocity(robot: Robot, joints: tuple[int, ...], live: frozenset[str],
                        variant: str | None) -> Iterator[Change]:
    """The law ``kp (qd - q) + kd (d/dt qd - v) + pe``, which leads by the reference's velocity."""
    if "qd" not in live:
        return
    for kind in dict.fromkeys((variant, "difference", "two_tap")):
        if kind is None or kind == "exact":
            continue
        yield Change(
            "law.reference_velocity", joints, "The law of {joints} leads by the velocity of the "
            "reference, Kd (dqd/dt - v) in the place of -Kd v", "The lead counts as excitation, "
            "which moves robot and model alike.",
            functools.partial(_with_reference_velocity, robot=robot, joints=joints, kind=kind))


def _with_reference_velocity(record: Record, robot: Robot, joints: tuple[int, ...],
                             kind: str) -> Record:
    reference = record.replace(q=record.signal("qd"))
    law = control_law(robot.controller, sample_time(record, robot.controller), kind)
    added = np.zeros_like(record.q) if record.pe is None else record.pe.copy()
    lead = law.kd * velocity(reference, robot.controller, kind)
    added[:, list(joints)] += np.where(np.isfinite(lead), lead, 0.0)[:, list(joints)]
    return record.replace(pe=added)


def _and(signals: Sequence[str]) -> str:
    return " and ".join(signals)


def _is_are(signals: Sequence[str]) -> str:
    names = " and ".join(WORDS[name] for name in signals)
    return f"The {names} of {{joints}} {'are' if len(signals) > 1 else 'is'}"
