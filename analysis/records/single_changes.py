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

from clie_blocks.analysis.records.control_law import control_law, gains
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import sample_time, settled_samples, velocity
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.two_encoders import OTHER
from clie_blocks.analysis.records.units import DEGREE, TURN

ANGLE_UNITS = {"degrees": DEGREE, "turns": TURN, "mrad": 1e-3}
MOST_PERMUTED = 4  # joints of which every order is tried; of more, every exchange of two
SAME_OFFSET = 0.05  # relative difference of two offsets that are one
LONGEST_LAG = 0.25  # s, of one channel behind the others
# A factor nearer to one is that of a sensor, which is calibrated to some percent.  Units that are
# mistaken for each other are farther apart, the nearest of them N m and lbf ft.
OF_SENSOR = 1.3
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
    remedy : str
        Where the log is right and the robot file is not: what to do, in the place of the change.
    unnamed : bool
        By a factor that no unit has, so that named ones come before it.
    unweighed : bool
        The law alone cannot tell it from other gains: the stated inertia must agree.
    effect : str
        Effect of the catalogue that the fault is; empty for what the catalogue lacks.

    """

    check: str
    joints: tuple[int, ...]
    what: str
    done: str
    apply: Callable[[Record], Record]
    remedy: str = ""
    unnamed: bool = False
    unweighed: bool = False
    effect: str = ""


def single_changes(records: Sequence[Record], robot: Robot, joints: Sequence[int],
                   variant: str | None) -> Iterator[Change]:
    """Changes of the signals of some joints, of which each is one fault of recording."""
    chosen = tuple(joints)
    live = _live_signals(records)
    yield from _angle_units(robot, chosen, live)
    yield from _torque_units(robot, chosen, live)
    yield from _signs(chosen, live)
    yield from _orders(robot, chosen, live)
    yield from _lags(records, robot, chosen, live, variant)
    yield from _common_factors(records, robot, chosen, live, variant)
    yield from _offsets(records, robot, chosen, variant)
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
    both = {OTHER} & set(record.extra) if "q" in signals else ()
    extra = {**record.extra, **{name: record.extra[name] * factor for name in both}}
    return record.replace(extra=extra, **{name: getattr(record, name) * factor for name in signals
                                          if getattr(record, name) is not None})


def _scaling(check: str, what: str, signals: tuple[str, ...], joints: tuple[int, ...],
             factors: np.ndarray) -> Change:
    with_rate = (*signals, "dq") if "q" in signals else signals
    shown = ", ".join(dict.fromkeys(f"{factors[k]:.6g}" for k in joints))
    return Change(check, joints, what, f"Multiplied {_and(signals)} by {shown}.",
                  lambda record: scaled(record, with_rate, joints, factors))


def _angle_units(robot: Robot, joints: tuple[int, ...], live: frozenset[str]) -> Iterator[Change]:
    """Angles in another unit, or on the motor side of the gear."""
    one, ratio = np.ones(robot.n), robot.motor.gear_ratio
    for signals in _groups(live, ("q", "qd"), ("q",), ("qd",)):
        for unit, factor in ANGLE_UNITS.items():
            yield _scaling("units.position", f"{_is_are(signals)} in {unit}", signals, joints,
                           factor * one)
        if ratio is not None and (ratio[list(joints)] != 1).any():
            yield _scaling("position.side", f"{_is_are(signals)} on the motor side of the gear",
                           signals, joints, 1 / ratio)


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
    """Columns of some joints in another order, or the joints of the robot file."""
    every = tuple(name for name in ("q", "qd", "u", "pe") if name in live)
    for signals in _groups(live, ("u",), ("q",), ("qd",), ("pe",), ("u", "pe"), ("q", "qd"),
                           every):
        for order in _permutations(joints):
            whole = list(range(robot.n))
            for joint, source in zip(joints, order, strict=True):
                whole[joint] = source
            pairs = ", ".join(f"{robot.joints[k]} in the column of {robot.joints[j]}"
                              for k, j in enumerate(whole) if j != k)
            with_rate = (*signals, "dq") if "q" in signals else signals
            moved = tuple(k for k, j in enumerate(whole) if j != k)
            if signals == every:
                yield Change("order.file", moved, "The gains of {joints} in the robot file are "
                             "swapped", "", _reordering(with_rate, whole),
                             "List the joints in robot.toml in the order of the log's columns, in "
                             "all sections.")
            else:
                yield Change("order", moved, f"{_is_are(signals)} swapped, that of {pairs}",
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
    may compute in one cycle and send in the next.  So are positions and references that stand
    before what the law used: it may have them late, which no recorder has to do with.  A law that
    uses them before they are written down there is not: that is the recorder's.
    """
    for signals in _groups(live, ("q",), ("qd",), ("pe",), ("u",)):
        lively = max(records, key=lambda record: float(np.nanstd(record.signal(signals[0]))))
        parts = _parts_of_law(lively, robot, variant)
        late = {_lag_of(parts, signals[0], k, lively.sample_time) for k in joints}
        rows = late.pop() if len(late) == 1 else 0
        may_be_of_law = rows == 1 if signals == ("u",) else rows < 0 and signals != ("pe",)
        if rows == 0 or may_be_of_law:
            continue
        side, shift = ("late", "earlier") if rows > 0 else ("early", "later")
        count = f"{abs(rows)} row{'s' if abs(rows) > 1 else ''}"
        yield Change("lag", joints, f"{_is_are(signals)} logged {count} too {side}",
                     f"Moved {_and(signals)} {count} {shift}.",
                     _shifting(signals, joints, rows),
                     effect="channel_skew" if signals == ("u",) and rows > 0 else "")


def _parts_of_law(record: Record, robot: Robot, variant: str | None) -> dict[str, np.ndarray]:
    """What each signal contributes to ``kp qd - (kp q + kd v) + pe - u``, 0 by the law."""
    law = control_law(robot.controller, sample_time(record, robot.controller), variant)
    rate = velocity(record, robot.controller, law.variant)
    parts = {"q": -(law.kp * record.q + law.kd * rate), "u": -record.signal("u"),
             "qd": law.kp * record.signal("qd"),
             "pe": np.zeros_like(record.q) if record.pe is None else record.pe}
    known = settled_samples(record, robot.controller, law.settling) & np.all(
        [np.isfinite(part).all(axis=1) for part in parts.values()], axis=0)
    return {name: np.where(known[:, None], part, 0.0) for name, part in parts.items()}


def _lag_of(parts: dict[str, np.ndarray], name: str, k: int, step: float) -> int:
    """Rows by which a signal of joint k lags behind the others: where they agree best."""
    known = np.flatnonzero(np.any([part[:, k] != 0 for part in parts.values()], axis=0))
    span = slice(known[0], known[-1] + 1) if known.size else slice(None)
    own = parts[name][span, k]
    others = -sum(part[span, k] for other, part in parts.items() if other != name)
    reach = min(round(LONGEST_LAG / step), len(own) // 4)
    size = 1 << (len(own) + reach).bit_length()
    product = np.fft.irfft(np.fft.rfft(own, size) * np.conj(np.fft.rfft(others, size)), size)
    lags = np.arange(-reach, reach + 1)
    of_own, of_others = (np.concatenate(([0.0], np.cumsum(x**2))) for x in (own, others))
    first, last = np.maximum(lags, 0), len(own) + np.minimum(lags, 0)
    energy = of_own[last] - of_own[first] + of_others[last - lags] - of_others[first - lags]
    return int(lags[np.argmin((energy - 2 * product[lags]) / (last - first))])


def _common_factors(records: Sequence[Record], robot: Robot, joints: tuple[int, ...],
                    live: frozenset[str], variant: str | None) -> Iterator[Change]:
    """Torques that are the law's times one number, as percent of a rated torque are."""
    if not live.issuperset(("u", "qd")):
        return
    for signals in _groups(live, ("u",), ("u", "pe")):
        factors = np.ones(robot.n)
        for k in joints:
            command, law = [], []
            for record in records:
                parts = {name: part[:, k] for name, part in
                         _parts_of_law(record, robot, variant).items()}
                outside = parts["pe"] if "pe" in signals else 0.0
                command.append(-parts["u"] - outside)
                law.append(parts["q"] + parts["qd"] + parts["pe"] - outside)
            x, y = np.concatenate(law), np.concatenate(command)
            factors[k] = y @ x / max(x @ x, np.finfo(float).tiny)
        found = factors[list(joints)]
        if (found <= 0).any() or np.abs(np.log(found)).max() < np.log(OF_SENSOR):
            continue
        shown = ", ".join(f"{factors[k]:.5g}" for k in joints)
        alone = "pe" in live and signals == ("u",)
        yield dataclasses.replace(
            _scaling("units.torque", f"{_is_are(signals)} {shown} times that of the law, so in "
                     "another unit, as percent of a rated torque", signals, joints, 1 / factors),
            unnamed=True, unweighed=not alone)
        if not alone:
            shown = ", ".join(f"{1 / factors[k]:.5g}" for k in joints)
            yield dataclasses.replace(
                _scaling("units.position", f"{_is_are(('q', 'qd'))} {shown} times the angle",
                         ("q", "qd"), joints, factors), unnamed=True, unweighed=True,
                remedy="Correct the unit, or the counts per turn, of the exported positions.")


def _offsets(records: Sequence[Record], robot: Robot, joints: tuple[int, ...],
             variant: str | None) -> Iterator[Change]:
    """Positions with another zero than the reference and the robot file.

    A constant in the command does the same to the law, so the stated start has to agree.
    """
    lost = np.concatenate([-sum(_parts_of_law(record, robot, variant).values())
                           for record in records])
    known = lost.any(axis=1)
    if not known.any():
        return
    gain, at = gains(robot.controller)[0], list(joints)
    offset = np.zeros(robot.n)
    offset[at] = lost[known].mean(axis=0)[at] / np.where(gain == 0, np.inf, gain)[at]
    moved = start_offsets(records, robot)
    if moved is None or not np.allclose(moved[:, at], offset[at], rtol=SAME_OFFSET, atol=0.0):
        return
    shown = ", ".join(f"{offset[k]:.4g}" for k in joints)
    yield Change("position.zero", joints, "The position q of {joints} has another zero than "
                 "its reference and the stated start", f"Took {shown} off it.",
                 lambda record: record.replace(q=record.q - offset))


def start_offsets(records: Sequence[Record], robot: Robot, name: str = "q") -> np.ndarray | None:
    """First values of a signal less the stated starts, shape (logs, n); None where not stated."""
    starts = [getattr(robot.experiments.get(f"log-{k + 1}"), "start", None)
              for k in range(len(records))]
    signals = [getattr(record, name) for record in records]
    if any(x is None for x in (*starts, *signals)):
        return None
    return np.array([x[0] - start for x, start in zip(signals, starts, strict=True)])


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
            functools.partial(_with_reference_velocity, robot=robot, joints=joints, kind=kind),
            effect="control_law_form")


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
