"""What meets between two columns: the ends of each net, with bends for wires that go further.

Channel c lies left of column c.  A wire that runs back leaves to the right, turns, passes its
columns as bends and turns again before its target.
"""

from dataclasses import dataclass, field

from clie_blocks.diagrams.drawing.graph import Graph, Pin
from clie_blocks.diagrams.drawing.shapes import Node


@dataclass
class Net:
    """Ends of one net in one channel: pins ``(node, port)`` at its left and at its right."""

    left: list[Pin] = field(default_factory=list)
    right: list[Pin] = field(default_factory=list)
    ends: list[tuple[str, Pin]] = field(default_factory=list)  # with their side, as added

    @property
    def entry(self) -> tuple[str, Pin]:
        """Side and pin through which the signal comes: the first one."""
        return self.ends[0]

    def add(self, side: str, pin: Pin) -> None:
        """Add a pin; the first one is the entry."""
        self.ends.append((side, pin))
        pins = self.left if side == "left" else self.right
        if pin not in pins:
            pins.append(pin)


def channels_of(graph: Graph, nodes: dict[str, Node],
                column: dict[str, int]) -> list[dict[Pin, Net]]:
    """Nets of every channel by source pin; adds the bends of long wires to nodes and column."""
    count = max(column.values(), default=0) + 2
    channels: list[dict[Pin, Net]] = [{} for _ in range(count)]

    def meet(c: int, net: Pin, side: str, pin: Pin) -> None:
        channels[c].setdefault(net, Net()).add(side, pin)

    def bend(net: Pin, c: int) -> Pin:
        key = f"{net[0]}|{net[1]}|{c}"
        nodes.setdefault(key, Node(key, left=["~"], right=["~"], above=0, below=0))
        column[key] = c
        return key, "~"

    for wire in graph.wires:
        net, start, end = wire.source, column[wire.source[0]], column[wire.target[0]]
        meet(start + 1, net, "left", wire.source)
        passed = range(start + 1, end) if end > start else range(start, end - 1, -1)
        for c in passed:
            near, far = (c, c + 1) if end > start else (c + 1, c)
            meet(near, net, "right" if end > start else "left", bend(net, c))
            meet(far, net, "left" if end > start else "right", bend(net, c))
        meet(end, net, "right", wire.target)
    return channels
