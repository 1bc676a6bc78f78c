"""From a diagram to the plan of its picture: columns, heights and lanes become points."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from clie_blocks.diagrams.drawing import layers, shapes
from clie_blocks.diagrams.drawing.canonical import canonical
from clie_blocks.diagrams.drawing.channels import Net, channels_of
from clie_blocks.diagrams.drawing.graph import Block, Graph, Pin, read_graph
from clie_blocks.diagrams.drawing.hints import FREE, Hints
from clie_blocks.diagrams.drawing.labels import labels_of
from clie_blocks.diagrams.drawing.order import Arrangement, arrange, swap_ports
from clie_blocks.diagrams.drawing.plan import Arrow, Box, Label, Layout, Piece, Point, Run
from clie_blocks.diagrams.drawing.routing import heights, lanes_of, pin_heights, take_drops
from clie_blocks.diagrams.drawing.shapes import GRID, Node
from clie_blocks.diagrams.drawing.texts import measure

if TYPE_CHECKING:
    import control as ct

LANE, LEAVE, ARRIVE = 12.0, 20.0, 18.0
CANDIDATES, BENT = 16, 0.15


def layout(diagram: ct.InterconnectedSystem, expand: bool | Collection[str] = False,
           names: Mapping[str, str] | None = None, hints: Hints = FREE) -> Layout:
    """Plan the picture of a diagram: the same plan in whatever order its blocks are listed.

    `expand` is as in `read_graph`; `names` are shown instead of the blocks' own, by block key.
    """
    return plan_of(_renamed(read_graph(diagram, expand), names or {}), hints)


def plan_of(graph: Graph, hints: Hints = FREE) -> Layout:
    """Plan the picture of blocks and wires, whichever diagram they come from, or none."""
    return _plan(graph, hints, outside=True)


def _renamed(graph: Graph, names: Mapping[str, str]) -> Graph:
    for key, block in graph.blocks.items():
        inner = _renamed(block.inner, names) if block.inner else None
        graph.blocks[key] = replace(block, name=names.get(key, block.name), inner=inner)
    return graph


def _plan(graph: Graph, hints: Hints, outside: bool = False) -> Layout:
    graph = canonical(graph)
    inside = {key: _plan(block.inner, hints)
              for key, block in graph.blocks.items() if block.inner}
    nodes = {key: shapes.node_of(block, inside.get(key)) for key, block in graph.blocks.items()}
    column = layers.columns(graph, hints)
    if not outside:
        column = layers.last_column_outputs(graph, column)
    channels = channels_of(graph, nodes, column)
    arrangement = Arrangement(nodes, column, channels, hints)
    y = _best_heights(arrangement)
    drops = take_drops(arrangement)
    lanes = lanes_of(arrangement, y)
    return _Plan(graph, arrangement, y, lanes, drops).finish()


def _best_heights(arrangement: Arrangement) -> dict[str, float]:
    """Arrange the columns so that crossings and bends together are few."""
    least = float("inf")
    for snapshot in arrange(arrangement)[:CANDIDATES]:
        arrangement.restore(snapshot)
        for _ in range(2):
            arrangement.y, bent = heights(arrangement)
            cost = arrangement.cost() + BENT * bent
            if cost < least - 1e-9:
                least, best = cost, (arrangement.snapshot(), dict(arrangement.y))
            if cost > least + 1e-9:
                break
            swap_ports(arrangement)
    arrangement.restore(best[0])
    return best[1]


class _Plan:
    """Turns columns, heights and lanes into points."""

    def __init__(self, graph: Graph, arrangement: Arrangement, y: Mapping[str, float],
                 lanes: list[dict[Pin, int]], drops: dict[str, Pin]) -> None:
        self.drops = drops
        self.graph, self.nodes, self.channels = graph, arrangement.nodes, arrangement.channels
        self.column, self.columns, self.lanes = arrangement.column, arrangement.columns, lanes
        top = min((y[key] - node.above for key, node in self.nodes.items()), default=0) - 1
        low = max((y[key] + node.below for key, node in self.nodes.items()), default=0) + 1
        self.grid = {key: value - top for key, value in y.items()}
        self.result = Layout(height=(low - top) * GRID)
        self._widths()

    def _widths(self) -> None:
        """Left edge and width of each column, and of the first lane of each channel."""
        self.left: list[float] = []
        self.breadth: list[float] = []
        self.first_lane: list[float] = []
        x = 0.0
        for c, channel in enumerate(self.lanes):
            outer = c in (0, len(self.lanes) - 1)
            used = max(channel.values(), default=-1) + 1
            self.first_lane.append(x + LEAVE)
            if used or not outer:
                x += LEAVE + ARRIVE + LANE * max(used - 1, 0)
            if c < len(self.columns):
                self.left.append(x)
                self.breadth.append(max([self.nodes[key].width for key in self.columns[c]] or [0]))
                x += self.breadth[-1]
        self.result.width = x

    def finish(self) -> Layout:
        """Place everything."""
        for key, node in self.nodes.items():
            if node.block is not None:
                self._box(key, node, node.block)
        for source in dict.fromkeys(wire.source for wire in self.graph.wires):
            self._run(source)
        return self.result

    def _middle(self, key: str) -> Point:
        c = self.column[key]
        return self.left[c] + self.breadth[c] / 2, self.grid[key] * GRID

    def _box(self, key: str, node: Node, block: Block) -> None:
        (x, y), (width, height) = self._middle(key), node.body
        box = Box(block, x - width / 2, y - height / 2, width, height, column=self.column[key],
                  left=tuple(node.left), right=tuple(node.right))
        self.result.boxes[key] = box
        self.result.labels += labels_of(node, box)
        if node.picture is not None:
            self._inside(node.picture, box.x + 2 * GRID, box.y + 3 * GRID)

    def _inside(self, picture: Layout, dx: float, dy: float) -> None:
        for key, box in picture.boxes.items():
            self.result.boxes[key] = replace(box, x=box.x + dx, y=box.y + dy,
                                             depth=box.depth + 1)
        self.result.labels += [replace(label, x=label.x + dx, y=label.y + dy)
                               for label in picture.labels]
        for run in picture.runs:
            pieces = tuple(((a + dx, b + dy), (c + dx, d + dy)) for (a, b), (c, d) in run.pieces)
            arrows = tuple((x + dx, y + dy, across, down) for x, y, across, down in run.arrows)
            self.result.runs.append(replace(run, pieces=pieces, arrows=arrows))

    def _run(self, source: Pin) -> None:
        """Collect the pieces of one net over all channels."""
        pieces: list[Piece] = []
        arrows: list[Arrow] = []
        for c, nets in enumerate(self.channels):
            if source in nets:
                self._cross(c, source, nets[source], pieces, arrows)
        for key, node in self.nodes.items():
            if node.is_bend and key.startswith(f"{source[0]}|{source[1]}|"):
                self._pass(key, source, pieces, arrows)
        wires = [wire for wire in self.graph.wires if wire.source == source]
        run = Run(source, tuple(wire.target for wire in wires), wires[0].width,
                  tuple(pieces), tuple(arrows))
        self.result.runs.append(run)
        self._width_label(run)

    def _pass(self, key: str, source: Pin, pieces: list[Piece],
              arrows: list[Arrow]) -> None:
        """Piece of a long wire past its column, and what drops from it onto a sum."""
        c, y = self.column[key], self.grid[key] * GRID
        stops = [self.left[c], self.left[c] + self.breadth[c]]
        if key in self.drops:
            port, target = self.drops[key]
            x, _ = self._middle(target)
            reach = self._tail("L", (target, port), y)[-1]
            pieces.append(((x, y), reach))
            arrows.append((*reach, 0, 1 if y < reach[1] else -1))
            stops.insert(1, x)
            if not any((key, "~") in net.right for net in self.channels[c].values()):
                stops.pop(0)
        pieces.extend(((a, y), (b, y)) for a, b in zip(stops, stops[1:]) if a < b)

    def _cross(self, c: int, source: Pin, net: Net, pieces: list[Piece],
               arrows: list[Arrow]) -> None:
        """Pieces of a net in one channel: a stub for each pin and the upright that joins them."""
        left, right = pin_heights(self.nodes, net, self.grid)
        tails = ([self._tail("R", pin, y * GRID) for pin, y in zip(net.left, left)]
                 + [self._tail("L", pin, y * GRID) for pin, y in zip(net.right, right)])
        for tail in tails:
            pieces.extend(zip(tail, tail[1:]))
        for pin, tail in zip(net.right, tails[len(left):]):
            if not self.nodes[pin[0]].is_bend:
                (x0, y0), (x1, y1) = tail[-2:] if len(tail) > 1 else ((0, 0), (1, 0))
                arrows.append((*tail[-1], (x1 > x0) - (x1 < x0), (y1 > y0) - (y1 < y0)))
        starts = [tail[0] for tail in tails]
        if source not in self.lanes[c]:
            pieces.append((starts[0], starts[1]))
            return
        x = self.first_lane[c] + LANE * self.lanes[c][source]
        pieces.extend(((x, y), (px, y)) for px, y in starts)
        levels = sorted({y for _, y in starts})
        pieces.extend(((x, a), (x, b)) for a, b in zip(levels, levels[1:]))

    def _tail(self, side: str, pin: Pin, y: float) -> list[Point]:
        """Path from where a pin can be reached in the channel to the outline of its block."""
        node = self.nodes[pin[0]]
        c = self.column[pin[0]]
        if node.is_bend:
            return [(self.left[c] + (0 if side == "L" else self.breadth[c]), y)]
        x, middle = self._middle(pin[0])
        half = node.body[0] / 2
        edge = (x - half if side == "L" else x + half), y
        if node.picture is not None:
            terminal = next(box for box in self.result.boxes.values() if box.depth == 1
                            and box.key in node.picture.boxes and box.middle[1] == y
                            and box.block.kind == ("input" if side == "L" else "output"))
            inner = terminal.x if side == "L" else terminal.x + terminal.width
            return [edge, (inner, y)]
        if node.main is not None and side == "L" and pin[1] != node.main:
            reach = middle + (shapes.SUM_RADIUS if y > middle else -shapes.SUM_RADIUS)
            return [(x - half, y), (x, y), (x, reach)]
        return [edge]

    def _width_label(self, run: Run) -> None:
        """Number of signals over the start of a vector wire."""
        if run.width == 1:
            return
        box = self.result.boxes[run.source[0]]
        node = self.nodes[run.source[0]]
        y = (self.grid[run.source[0]] + node.offset("R", run.source[1])) * GRID
        text, ahead = str(run.width), measure(shapes.out_label(box.block), shapes.PORT)[0]
        width, height = measure(text, shapes.SMALL)
        x = box.x + box.width + (ahead + 4 if ahead else 0) + 4 + width / 2
        self.result.labels.append(Label(text, x, y - 2 - height / 2, width, height,
                                        shapes.SMALL, owner=box.key))
