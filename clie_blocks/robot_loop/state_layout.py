"""Where the states of a simulated robot lie in one vector: blocks of rows, one value per joint."""

import dataclasses
import functools
from collections.abc import Mapping

import numpy as np

from clie_blocks.robot_loop.dynamics import Memory, NamedPieces


@dataclasses.dataclass(frozen=True, eq=False)
class StateLayout:
    """Blocks of a state vector, in order.

    Parameters
    ----------
    n : int
        Joints.
    rows : mapping
        Name of a block -> its states per joint.
    offset : int
        States of other kinds before the first block.

    """

    n: int
    rows: Mapping[str, int]
    offset: int = 0

    @functools.cached_property
    def slices(self) -> dict[str, slice]:
        """Where each block lies."""
        slices, first = {}, self.offset
        for name, rows in self.rows.items():
            slices[name] = slice(first, first + rows * self.n)
            first += rows * self.n
        return slices

    @property
    def size(self) -> int:
        """Length of the whole vector."""
        return self.offset + self.n * sum(self.rows.values())

    @property
    def labels(self) -> list[str]:
        """Names of the states of the blocks: ``block[joint]``, or ``block_row[joint]``."""
        return [f"{name}[{k}]" if rows == 1 else f"{name}_{row}[{k}]"
                for name, rows in self.rows.items() for row in range(rows) for k in range(self.n)]

    def unpack(self, x: np.ndarray) -> Memory:
        """States of each block, as one array (n,) per row."""
        return {name: [x[first:first + self.n] for first in range(where.start, where.stop, self.n)]
                for name, where in self.slices.items()}


def rows_of_pieces(pieces: NamedPieces) -> dict[str, int]:
    """States per joint of each effect's block."""
    rows: dict[str, int] = {}
    for name, piece in pieces:
        rows[name] = rows.get(name, 0) + piece.states
    return rows
