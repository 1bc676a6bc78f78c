"""Tables that join topics: a row for every message, with empty cells for the other topics.

PlotJuggler and others export so.  Rows with a measured position are kept; a signal of another
topic holds from its own time to the next, as commands of a bag do.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.records.columns import Layout
from clie_blocks.analysis.records.resampling import hold_last
from clie_blocks.analysis.records.table import Packed

ALTERNATING = 0.3  # 1, changes from a row with a position to one without, per row with one
LEAST_ROWS = 20  # rows with a position


def keep_positions(packed: Packed, layout: Layout, masked_by: tuple[str, ...],
                   ) -> tuple[Packed, list[str]]:
    """Return the rows with a position, the other topics held, and what was done as sentences.

    A table that does not join topics is returned as it is: a dropout is no topic.
    """
    stops = np.cumsum([len(indices) for indices in layout.columns.values()])
    parts = {signal: slice(int(stop) - len(indices), int(stop))
             for (signal, indices), stop in zip(layout.columns.items(), stops, strict=True)}
    rows = packed.valid.copy()  # a sample that is valid has a position, and a long log is mapped
    holes = np.flatnonzero(~rows)
    rows[holes] = np.isfinite(packed.values[holes, parts["q"]]).any(axis=1)
    lost = np.count_nonzero(rows[:-1] & ~rows[1:])
    if rows.sum() < LEAST_ROWS or lost < ALTERNATING * rows.sum():
        return packed, []
    present = {signal: np.isfinite(packed.values[:, part]).any(axis=1)
               for signal, part in parts.items()}
    values = np.array(packed.values[rows])
    held = [signal for signal, has in present.items()
            if np.count_nonzero(has & ~rows) > np.count_nonzero(has & rows)]
    for signal in held:
        own = present[signal]
        values[:, parts[signal]], _ = hold_last(
            packed.stamps[own], packed.values[own, parts[signal]], packed.stamps[rows])
    finite = np.isfinite(values)
    needed = sum(len(indices) for signal, indices in layout.columns.items()
                 if signal in masked_by)
    values.flags.writeable = False
    note = (f"The table joins topics: kept the {len(values)} of {len(rows)} rows that have a "
            "position.")
    if held:
        note += f" Held from its own time to the next: {', '.join(held)}."
    return dataclasses.replace(packed, stamps=packed.stamps[rows], values=values,
                               valid=finite[:, :needed].all(axis=1)), [note]
