"""Runs: the ranges of a record in which every sample follows the one before without a break."""

import numpy as np


def runs(record, least=2):
    """Half-open ranges of valid samples inside one segment of a record.

    Parameters
    ----------
    record : Record
        The record.
    least : int
        Shorter runs are left out.

    Returns
    -------
    list of (int, int)
        Ranges in order.

    """
    breaks = np.zeros(len(record) + 1, bool)
    breaks[[edge for pair in record.segments for edge in pair]] = True
    inside = np.zeros(len(record), bool)
    for start, stop in record.segments:
        inside[start:stop] = record.valid[start:stop]
    follows = inside[1:] & inside[:-1] & ~breaks[1:-1]
    starts = np.flatnonzero(inside & ~np.concatenate(([False], follows)))
    stops = np.flatnonzero(inside & ~np.concatenate((follows, [False]))) + 1
    return [(int(a), int(b)) for a, b in zip(starts, stops, strict=True) if b - a >= least]
