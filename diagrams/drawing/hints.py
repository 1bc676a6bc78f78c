"""What a picture keeps of a former one, and what its user asks for: columns, heights, ports.

A hint is a *rank*: numbers by key of a block, of which only the order counts.  Ranks of columns
hold from left to right, those of heights from top to bottom within a column.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from clie_blocks.diagrams.drawing.plan import Layout

Rank = Mapping[str, float]


@dataclass(frozen=True)
class Hints:
    """Ranks of columns and of heights, and the order of ports by key and side ('L', 'R').

    Two ranks say nothing about each other: what the user asks for, and what stood there before.
    """

    columns: tuple[Rank, ...] = ()
    heights: tuple[Rank, ...] = ()
    ports: Mapping[tuple[str, str], Rank] = field(default_factory=dict)

    def port_ranks(self, key: str, side: str) -> tuple[Rank, ...]:
        """Ranks of the ports of one side of a block."""
        return (self.ports[key, side],) if (key, side) in self.ports else ()


FREE = Hints()


def keep(items: list[str], ranks: Iterable[Rank]) -> None:
    """Sort the items of each rank among the places that they take."""
    for rank in ranks:
        places = [k for k, item in enumerate(items) if item in rank]
        for place, item in zip(places, sorted((items[k] for k in places), key=rank.__getitem__)):
            items[place] = item


def are_held(ranks: Iterable[Rank], a: str, b: str) -> bool:
    """Whether two items must stay as they follow each other."""
    return any(a in rank and b in rank for rank in ranks)


def hints_of(former: Layout | None, columns: Sequence[Sequence[str]],
             order: Sequence[str]) -> Hints:
    """Hints of a user, and of the picture to which this one is to be like."""
    asked = {key: float(k) for k, group in enumerate(columns) for key in group}
    above = {key: float(k) for k, key in enumerate(order)}
    if former is None:
        return Hints((asked,), (above,))
    boxes = former.boxes.items()
    return Hints(
        (asked, {key: float(box.column) for key, box in boxes
                 if key not in asked and box.block.kind not in ("input", "output")}),
        (above, {key: box.middle[1] for key, box in boxes if key not in above}),
        {(key, side): {port: float(k) for k, port in enumerate(ports)}
         for key, box in boxes for side, ports in (("L", box.left), ("R", box.right))})
