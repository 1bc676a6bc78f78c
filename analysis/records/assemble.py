"""From the columns of a log to a `Record`: units to SI, the clock, the mask, the decisions."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from clie_blocks.analysis.records.clock import repeated_stamps, seconds, segments
from clie_blocks.analysis.records.columns import Layout, find_columns
from clie_blocks.analysis.records.joined_topics import keep_positions
from clie_blocks.analysis.records.model import CHANNELS, DEFAULT_UNITS, Record
from clie_blocks.analysis.records.robot import Robot, speaks_of_torque
from clie_blocks.analysis.records.table import Packed, Table, pack
from clie_blocks.analysis.records.units import to_si
from clie_blocks.errors import RecordError

UNKNOWN_COMMAND = (
    "No unit is stated for u, and the robot file has no gain, inertia or torque: u may be a "
    "torque, a current or a percentage, and results are per unit of u. State it in the header, as "
    "u1 [N m], or in [units].")
MASKED_BY = ("q", "u", "qd", "pe")  # a hole in one of these makes the sample useless


def assemble(table: Table, robot: Robot | None = None, columns: Mapping[str, str] | None = None,
             time_unit: str | None = None) -> Record:
    """Return the record of a table, in SI.

    The user's map from signal to column pattern overrides that of the robot, and the user's unit
    of the clock overrides what the log states.
    """
    user_map = {**(robot.columns if robot else {}), **(columns or {})}
    layout = find_columns(table.names, table.source, user_map, robot.joints if robot else ())
    factors, units, notes = _scales(table, layout, robot)
    packed = pack(table.blocks(layout.order()), factors,
                  sum(len(indices) for signal, indices in layout.columns.items()
                      if signal in MASKED_BY))
    if packed.stamps.size == 0:
        raise RecordError(f"{table.source} has a header but no samples with a time stamp; without "
                          "samples nothing can be learned; check the export")
    packed, joined = keep_positions(packed, layout, MASKED_BY)
    stated = time_unit or layout.units["time"][0] or table.time_unit or (
        robot.units.get("time") if robot else None)
    time, clock_notes = seconds(packed.stamps, stated,
                                robot.controller.sample_time if robot else None, table.source)
    ranges, cut_notes = segments(time)
    twins, twin_notes = repeated_stamps(time)
    signals, valid, empty_notes = _signals(layout, packed)
    extra = {name: signals.pop(name)[:, 0] for name in CHANNELS if name in signals}
    shown: dict[str, Any] = signals
    return Record(
        time=time, **shown, valid=valid & ~twins, joints=layout.joints, robot=robot, extra=extra,
        units={name: unit for name, unit in units.items() if name in signals},
        source=table.source, segments=ranges,
        decisions=(*table.decisions, *layout.decisions, *notes, *joined, *clock_notes, *cut_notes,
                   *twin_notes, *empty_notes, *_losses(packed.dropped, valid)))


def _scales(table: Table, layout: Layout,
            robot: Robot | None) -> tuple[list[float], dict[str, tuple[str, ...]], list[str]]:
    """Factors to SI of all columns after the clock, the SI units, and what was assumed."""
    factors, units, notes = [], {}, []
    for signal, stated in layout.units.items():
        if signal == "time":
            continue
        robots = robot.units.get(signal) if robot else None
        implied = layout.implied.get(signal)
        fallback = robots or implied
        assumed = _assumed_unit(signal, robot)
        scales = [to_si(unit or fallback or assumed, signal,
                        f"{table.source}: column {table.names[index]!r}")
                  for unit, index in zip(stated, layout.columns[signal])]
        factors += [factor for factor, _ in scales]
        units[signal] = tuple(unit for _, unit in scales)
        written = next((unit for unit in stated if unit), fallback)
        if implied and not robots and not any(stated) and scales[0][1] not in ("N m", "N") \
                and signal in ("u", "tau"):
            notes.append(f"{signal} is in {implied}, not a torque, as its name says.")
        if written and any(factor != 1 for factor, _ in scales):
            notes.append(f"Converted {signal} from {written} to {scales[0][1]}.")
        elif not written and any(note.startswith(f"Read {signal} ") for note in layout.decisions):
            notes.append(f"No unit is stated for {signal}; took {assumed}. If it is another: "
                         "[units] in robot.toml.")
        if signal == "u" and not written and assumed != DEFAULT_UNITS["u"]:
            notes.append(UNKNOWN_COMMAND)
    if layout.mask is not None:
        factors.append(1.0)
    return factors, units, notes


def _assumed_unit(signal: str, robot: Robot | None) -> str:
    """Unit of a signal for which none is stated.

    A command is taken as a torque where the robot file says anything in terms of one.
    """
    if signal not in ("u", "pe") or robot is None or speaks_of_torque(robot):
        return DEFAULT_UNITS[signal]
    return "u"


def _signals(layout: Layout,
             packed: Packed) -> tuple[dict[str, np.ndarray], np.ndarray, list[str]]:
    """Slice the packed values; a signal that never held a number for a joint is left out."""
    signals: dict[str, np.ndarray] = {}
    empty: list[str] = []
    start = 0
    for signal, indices in layout.columns.items():
        stop = start + len(indices)
        if signal == "q" or packed.filled[start:stop].all():
            signals[signal] = packed.values[:, start:stop]
        else:
            empty.append(signal)
        start = stop
    valid = packed.valid
    if set(empty) & set(MASKED_BY):
        valid = np.all([np.isfinite(value).all(axis=1) for signal, value in signals.items()
                        if signal in MASKED_BY], axis=0)
    if layout.mask is not None:
        valid = valid & (packed.values[:, -1] != 0) & np.isfinite(packed.values[:, -1])
    return signals, valid, [f"Left out {signal}: it is empty for at least one joint."
                            for signal in empty]


def _losses(dropped: int, valid: np.ndarray) -> list[str]:
    notes = []
    if dropped:
        notes.append(f"Dropped {dropped} rows without a time stamp.")
    holes = int(np.count_nonzero(~valid))
    if holes:
        notes.append(f"{holes} of {valid.size} samples have a value missing; they are "
                     "masked, not filled in.")
    return notes
