"""Blocks of a state vector lie one behind the other, row by row."""

import numpy as np

from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.robot_loop.dynamics import DELAY_TAPS
from clie_blocks.robot_loop.state_layout import StateLayout, rows_of_pieces


def test_a_vector_is_unpacked_into_rows_of_joints():
    layout = StateLayout(2, {"q": 1, "none": 0, "law": 2}, offset=1)
    assert layout.size == 7
    assert layout.slices == {"q": slice(1, 3), "none": slice(3, 3), "law": slice(3, 7)}
    states = layout.unpack(np.arange(7.0))
    assert {name: [row.tolist() for row in rows] for name, rows in states.items()} == {
        "q": [[1.0, 2.0]], "none": [], "law": [[3.0, 4.0], [5.0, 6.0]]}


def test_pieces_without_memory_have_an_empty_block():
    pieces = [(cause.block, piece) for cause in (COULOMB, TIME_DELAY) for piece in cause.pieces]
    assert rows_of_pieces(pieces) == {"coulomb": 0, "time_delay": DELAY_TAPS}
