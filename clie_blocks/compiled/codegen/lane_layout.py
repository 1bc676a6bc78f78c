"""Where the entries of a vector lie when several lanes are computed at once."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Memory:
    """What differs between lanes, and where it lies.

    An entry that differs takes `width` neighbouring numbers, one per lane; an entry that all
    lanes share takes one.

    Parameters
    ----------
    width : int
        Number of lanes; 1 gives plain scalar code.
    varying : dict
        By vector (``'x'`` states and their derivatives, ``'p'`` parameters, ``'record'``), one
        truth value per entry: it differs between lanes.  Vectors not named are shared.

    """

    width: int = 1
    varying: dict[str, tuple[bool, ...]] = field(default_factory=dict)

    @property
    def key(self) -> tuple:
        """What distinguishes this memory from others."""
        return self.width, tuple(sorted((name, tuple(flags))
                                        for name, flags in self.varying.items()))

    def varies(self, vector: str, k: int) -> bool:
        """Return whether entry k differs between lanes."""
        return bool(vector in self.varying and self.varying[vector][k])

    def offset(self, vector: str, k: int) -> int:
        """Return where entry k begins."""
        return k + (self.width - 1) * sum(self.varying.get(vector, ())[:k])

    def size(self, vector: str, entries: int) -> int:
        """Return the room that a vector of so many entries takes."""
        return self.offset(vector, entries)

    def positions(self, vector: str, entries: int) -> np.ndarray:
        """Return where each entry lies in each lane, as an array of shape (entries, width)."""
        flags = np.array(self.varying.get(vector, [False] * entries), bool)
        room = np.where(flags, self.width, 1)
        first = np.cumsum(room) - room
        return first[:, None] + np.where(flags[:, None], np.arange(self.width), 0)

    def pack(self, vector: str, values: np.ndarray) -> np.ndarray:
        """Return the vector in memory of values per lane, shape (entries, width)."""
        packed = np.empty(self.size(vector, len(values)))
        packed[self.positions(vector, len(values))] = values
        return packed


SINGLE = Memory()


def lanes(width: int, nx: int, nrecord: int, parameters: Iterable[bool]) -> Memory:
    """Return the memory of runs side by side: own states, own record, some own parameters."""
    return Memory(width, {"x": (True,) * nx, "record": (True,) * nrecord,
                          "p": tuple(map(bool, parameters))})
