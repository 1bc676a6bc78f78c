"""Runs: the ranges of a record in which every sample follows the one before without a break."""

import numpy as np

from clie_blocks.analysis.records.model import Record


def runs(record: Record, least: int = 2) -> list[tuple[int, int]]:
    """Half-open ranges of at least so many valid samples inside one segment, in order."""
    breaks = np.zeros(len(record) + 1, bool)
    breaks[[edge for pair in record.segments for edge in pair]] = True
    inside = np.zeros(len(record), bool)
    for start, stop in record.segments:
        inside[start:stop] = record.valid[start:stop]
    follows = inside[1:] & inside[:-1] & ~breaks[1:-1]
    starts = np.flatnonzero(inside & ~np.concatenate(([False], follows)))
    stops = np.flatnonzero(inside & ~np.concatenate((follows, [False]))) + 1
    return [(int(a), int(b)) for a, b in zip(starts, stops, strict=True) if b - a >= least]


def equal_ranges(labels: np.ndarray) -> list[tuple[int, int]]:
    """Half-open ranges of equal neighbouring labels, such as the run to which each row belongs."""
    edges = (np.flatnonzero(labels[1:] != labels[:-1]) + 1).tolist()
    return list(zip([0, *edges], [*edges, len(labels)], strict=True))
