"""From the columns of a log to a `Record`: units to SI, the clock, the mask, the decisions."""

import numpy as np

from clie_blocks.analysis.records.clock import repeated, seconds, segments
from clie_blocks.analysis.records.columns import find_columns
from clie_blocks.analysis.records.model import DEFAULT_UNITS, Record
from clie_blocks.analysis.records.table import pack
from clie_blocks.analysis.records.units import to_si
from clie_blocks.errors import RecordError

MASKED_BY = ("q", "u", "qd", "pe")  # a hole in one of these makes the sample useless


def assemble(table, robot=None, columns=None, time_unit=None):
    """Return the record of a table.

    Parameters
    ----------
    table : Table
        The log.
    robot : Robot, optional
        Its joint order, units, columns and sample time are used.
    columns : mapping, optional
        The user's map from signal to column pattern; it overrides the robot's.
    time_unit : str, optional
        Unit of the clock; it overrides what the log says.

    Returns
    -------
    Record
        In SI.

    Raises
    ------
    RecordError
        If signals are missing or ambiguous, units unknown, or there is no sample.

    """
    given = {**(robot.columns if robot else {}), **(columns or {})}
    layout = find_columns(table.names, table.source, given, robot.joints if robot else ())
    factors, units, notes = _scales(table, layout, robot)
    packed = pack(table.blocks(layout.order()), factors,
                  sum(len(found) for signal, found in layout.columns.items()
                      if signal in MASKED_BY))
    if packed.stamps.size == 0:
        raise RecordError(f"{table.source} has a header but no samples with a time stamp; without "
                          "samples nothing can be learned: check the export")
    stated = time_unit or layout.units["time"][0] or table.time_unit or (
        robot.units.get("time") if robot else None)
    time, clock_notes = seconds(packed.stamps, stated,
                                robot.controller.sample_time if robot else None, table.source)
    ranges, cut_notes = segments(time)
    twins, twin_notes = repeated(time)
    signals, valid, empty_notes = _signals(layout, packed)
    return Record(
        time=time, **signals, valid=valid & ~twins, joints=layout.joints, robot=robot,
        units={name: unit for name, unit in units.items() if name in signals},
        source=table.source, segments=ranges,
        decisions=(*table.decisions, *layout.decisions, *notes, *clock_notes, *cut_notes,
                   *twin_notes, *empty_notes, *_losses(packed.dropped, valid)))


def _scales(table, layout, robot):
    """Factors to SI of all columns after the clock, the SI units, and what was assumed."""
    factors, units, notes = [], {}, []
    for signal, stated in layout.units.items():
        if signal == "time":
            continue
        fallback = robot.units.get(signal) if robot else None
        found = [to_si(unit or fallback or DEFAULT_UNITS[signal], signal,
                       f"{table.source}: column {table.names[index]!r}")
                 for unit, index in zip(stated, layout.columns[signal])]
        factors += [factor for factor, _ in found]
        units[signal] = tuple(unit for _, unit in found)
        given = next((unit for unit in stated if unit), fallback)
        if given and any(factor != 1 for factor, _ in found):
            notes.append(f"Converted {signal} from {given} to {found[0][1]}.")
        elif not given and any(note.startswith(f"Read {signal} ") for note in layout.decisions):
            notes.append(f"No unit is stated for {signal}; took {DEFAULT_UNITS[signal]}.")
    if layout.mask is not None:
        factors.append(1.0)
    return factors, units, notes


def _signals(layout, packed):
    """Slice the packed values; a signal that never held a number for a joint is left out."""
    signals, empty, start = {}, [], 0
    for signal, found in layout.columns.items():
        stop = start + len(found)
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


def _losses(dropped, valid):
    notes = []
    if dropped:
        notes.append(f"Dropped {dropped} rows without a time stamp.")
    holes = int(np.count_nonzero(~valid))
    if holes:
        notes.append(f"{holes} of {valid.size} samples have a value missing; they are "
                     "masked, not filled in.")
    return notes
