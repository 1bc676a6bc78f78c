"""Order of the things in each column and of the ports of each block, for few crossings."""

import random
from collections.abc import Callable, Mapping, Sequence
from statistics import fmean

from clie_blocks.diagrams.drawing.channels import Net
from clie_blocks.diagrams.drawing.graph import Pin
from clie_blocks.diagrams.drawing.hints import Hints, Rank, are_held, keep
from clie_blocks.diagrams.drawing.shapes import Node

SidedPin = tuple[str, Pin]  # 'L' or 'R' of its node, and the pin
Partners = dict[str, dict[SidedPin, list[SidedPin]]]
Heights = tuple[list[float], list[float]]  # of the pins of a net, left and right of its channel
Snapshot = tuple[list[list[str]], dict[str, tuple[list[str], list[str]]]]

EFFORT, SWEEPS, PASSES = 3000, 6, 10
CLIMB, LEAD_CROSSED, COLUMN_TASTE, PORT_TASTE = 0.01, 1.0, 1.6, 0.02
GAP_BLOCKS, GAP_BEND, GAP_SLIM = 4, 3, 2


def gap(a: Node, b: Node) -> int:
    """Grid steps between the ends of two neighbours in a column."""
    if (a.is_bend and b.is_bend) or (a.is_terminal and b.is_terminal):
        return GAP_SLIM
    return GAP_BEND if a.is_bend or b.is_bend else GAP_BLOCKS


class Arrangement:
    """Columns of node keys with the port orders of their nodes, and how many wires cross."""

    def __init__(self, nodes: dict[str, Node], column: Mapping[str, int],
                 channels: list[dict[Pin, Net]], hints: Hints) -> None:
        self.hints = hints
        self.nodes, self.channels = nodes, channels
        self.column = column
        self.columns: list[list[str]] = [
            [] for _ in range(max(column.values(), default=0) + 1)]
        for key in nodes:
            self.columns[column[key]].append(key)
        self.rank = {key: k for k, key in enumerate(nodes)}
        blocks = [key for key, node in nodes.items() if not node.is_bend and not node.is_terminal]
        self.weight = {key: 4.0 / (4.0 + k) for k, key in enumerate(blocks)}
        self.partners = _partners(nodes, channels)
        self.leads = _leads(nodes, channels)
        self.y: dict[str, float] = {}
        self.keep_hints()
        self.stack()

    def stack(self, only: int | None = None) -> None:
        """Put the nodes of the columns on top of each other, each column centred."""
        for c in range(len(self.columns)) if only is None else [only]:
            y: float = 0
            previous: Node | None = None
            for key in self.columns[c]:
                node = self.nodes[key]
                y += node.above + (gap(previous, node) + previous.below if previous else 0)
                self.y[key], previous = y, node
            middle = (y + (previous.below if previous else 0)) / 2
            for key in self.columns[c]:
                self.y[key] -= middle

    def keep_hints(self) -> None:
        """Bring columns and ports into the orders that the hints hold."""
        for keys in self.columns:
            keep(keys, self.hints.heights)
        for key, node in self.nodes.items():
            for side, ports in self.sides(key):
                keep(ports, self.hints.port_ranks(key, side))
            if node.main is not None:
                node.fit_sum()

    def sides(self, key: str) -> tuple[tuple[str, list[str]], ...]:
        """Sides of a node with their ports, if these may be sorted."""
        node = self.nodes[key]
        return (("L", node.left), ("R", node.right)) if node.sortable else ()

    def pin_y(self, side: str, pin: Pin) -> float:
        """Height of a pin at the left or right ('L', 'R') of its node."""
        return self.y[pin[0]] + self.nodes[pin[0]].offset(side, pin[1])

    def snapshot(self) -> Snapshot:
        """Orders of columns and ports, to return to."""
        return ([list(keys) for keys in self.columns],
                {key: (list(node.left), list(node.right)) for key, node in self.nodes.items()})

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        columns, ports = snapshot
        self.columns = [list(keys) for keys in columns]
        for key, (left, right) in ports.items():
            self.nodes[key].left, self.nodes[key].right = list(left), list(right)
            if self.nodes[key].main is not None:
                self.nodes[key].fit_sum()
        self.stack()

    def turn_over(self) -> None:
        """Turn columns and ports upside down, unless an opened diagram fixes them."""
        columns, ports = self.snapshot()
        if not any(node.fixed for node in self.nodes.values()):
            turned = {key: (left[::-1], right[::-1]) for key, (left, right) in ports.items()}
            self.restore(([keys[::-1] for keys in columns], turned))
            self.keep_hints()
            self.stack()

    def crossings(self, c: int) -> float:
        """Crossings in channel c when each net has one upright, the better of the two orders.

        A strand that crosses a main line keeps it from being straight, and counts more.
        """
        nets = [([self.pin_y("R", pin) for pin in net.left],
                 [self.pin_y("L", pin) for pin in net.right])
                for net in self.channels[c].values()]
        lines = [(self.pin_y("R", a), self.pin_y("L", b)) for a, b in self.leads[c]]
        return _channel_crossings(nets) + LEAD_CROSSED * sum(
            _crosses(left, right, *line) for line in lines for left, right in nets)

    def taste(self, c: int) -> float:
        """How far a column and the ports in it depart from the order in which they were listed."""
        found = COLUMN_TASTE * inversions(self.columns[c], self.rank, self._importance)
        for key in self.columns[c]:
            node = self.nodes[key]
            if node.sortable and node.block is not None:
                ranks = {port: k for ports in (node.block.inputs, node.block.outputs)
                         for k, port in enumerate(ports)}
                found += PORT_TASTE * (inversions(node.left, ranks)
                                       + inversions(node.right, ranks))
        return found

    def _importance(self, upper: str, lower: str) -> float:
        """Weight of a pair in `taste`: what is listed first belongs on top, feedback below."""
        a, b = self.nodes[upper], self.nodes[lower]
        if a.is_terminal != b.is_terminal:
            return 0.0
        if a.is_terminal:
            return 0.8
        return self.weight.get(upper, 0.1) * self.weight.get(lower, 0.1)

    def column_cost(self, c: int) -> float:
        """What the order of one column costs: crossings on both sides, and taste."""
        return self.crossings(c) + self.crossings(c + 1) + self.taste(c)

    def cost(self) -> float:
        """Crossings, taste, and a little for the height that the wires climb."""
        climb = sum(abs(self.pin_y(*a) - self.pin_y(*b))
                    for pins in self.partners.values() for a, others in pins.items()
                    for b in others)
        return (sum(self.crossings(c) for c in range(len(self.channels))) + CLIMB * climb
                + sum(self.taste(c) for c in range(len(self.columns))))

    def sweep(self, rightwards: bool) -> None:
        """Sort each column by the mean height of what its nodes are wired to."""
        count = len(self.columns)
        for c in range(count) if rightwards else range(count - 1, -1, -1):
            near = c - 1 if rightwards else c + 1
            wish = {key: self._wish(key, near) for key in self.columns[c]}
            self.columns[c].sort(key=wish.__getitem__)
            keep(self.columns[c], self.hints.heights)
            self.stack(c)

    def _wish(self, key: str, near: int) -> float:
        heights = [self.pin_y(*other) - self.nodes[key].offset(*_at(pin))
                   for pin, others in self.partners[key].items() for other in others
                   if self.column[other[1][0]] in (near, self.column[key])
                   and other[1][0] != key]
        return fmean(heights) if heights else self.y[key]

    def sort_ports(self) -> None:
        """Sort the ports of each block by the mean height of their other ends."""
        for key, node in self.nodes.items():
            for side, ports in self.sides(key):
                wish = {port: self._port_wish(key, side, port, k)
                        for k, port in enumerate(ports)}
                ports.sort(key=wish.__getitem__)
                keep(ports, self.hints.port_ranks(key, side))
            if node.main is not None:
                node.fit_sum()

    def _port_wish(self, key: str, side: str, port: str, k: int) -> float:
        others = self.partners[key].get((side, (key, port)), [])
        heights = [self.pin_y(*other) for other in others]
        return fmean(heights) if heights else self.y[key] + 1e-3 * k


def arrange(arrangement: Arrangement) -> list[Snapshot]:
    """Orders with few crossings, the cheapest first; the listed one is tried first, wins ties."""
    size = max(len(arrangement.nodes) * len(arrangement.channels), 1)
    found, tries = [], min(max(EFFORT // size, 4), 24)
    for snapshot in _swept(arrangement, tries)[:3 + tries // 2]:
        arrangement.restore(snapshot)
        _swap_neighbours(arrangement)
        for change in (_keep, Arrangement.turn_over, _swap_neighbours):
            change(arrangement)
            candidate = arrangement.cost(), arrangement.snapshot()
            if candidate not in found:
                found.append(candidate)
    return [snapshot for _, snapshot in sorted(found, key=lambda item: item[0])]


def _keep(arrangement: Arrangement) -> None:
    """Leave the arrangement as it is."""


def _swept(arrangement: Arrangement, tries: int) -> list[Snapshot]:
    """Orders after sweeps from the listed order and from chance ones, the cheapest first."""
    chance = random.Random(0)
    start, found = arrangement.snapshot(), []
    for attempt in range(tries):
        arrangement.restore(start)
        if attempt:
            for keys in arrangement.columns:
                chance.shuffle(keys)
                keep(keys, arrangement.hints.heights)
            arrangement.stack()
        best, least = start, float("inf")
        for sweep in range(SWEEPS):
            arrangement.sweep(rightwards=sweep % 2 == 0)
            arrangement.sort_ports()
            cost = arrangement.cost()
            if cost < least - 1e-9:
                best, least = arrangement.snapshot(), cost
        found.append((least, attempt, best))
    return [snapshot for _, _, snapshot in sorted(found, key=lambda item: item[:2])]


def _swap_neighbours(arrangement: Arrangement) -> None:
    """Swap neighbours in columns and ports while that makes the picture better."""
    for _ in range(PASSES):
        better = False
        for c, keys in enumerate(arrangement.columns):
            better |= _swap_in(arrangement, c, keys, arrangement.hints.heights)
            for key in keys:
                for side, ports in arrangement.sides(key):
                    better |= _swap_in(arrangement, c, ports,
                                       arrangement.hints.port_ranks(key, side))
        if not better:
            break


def _swap_in(arrangement: Arrangement, c: int, items: list[str],
             ranks: Sequence[Rank]) -> bool:
    better, least = False, arrangement.column_cost(c)
    for k in range(len(items) - 1):
        if are_held(ranks, items[k], items[k + 1]):
            continue
        _swap(arrangement, c, items, k)
        cost = arrangement.column_cost(c)
        if cost < least - 1e-9:
            better, least = True, cost
        else:
            _swap(arrangement, c, items, k)
    return better


def swap_ports(arrangement: Arrangement) -> None:
    """Swap neighbouring ports where that removes crossings at the present heights."""
    for c, keys in enumerate(arrangement.columns):
        for key in keys:
            if arrangement.nodes[key].main is not None:
                continue
            for side, ports in arrangement.sides(key):
                ranks = arrangement.hints.port_ranks(key, side)
                for k in range(len(ports) - 1):
                    if are_held(ranks, ports[k], ports[k + 1]):
                        continue
                    before = arrangement.column_cost(c)
                    ports[k], ports[k + 1] = ports[k + 1], ports[k]
                    if arrangement.column_cost(c) >= before - 1e-9:
                        ports[k], ports[k + 1] = ports[k + 1], ports[k]


def _swap(arrangement: Arrangement, c: int, items: list[str], k: int) -> None:
    items[k], items[k + 1] = items[k + 1], items[k]
    for key in arrangement.columns[c]:
        if arrangement.nodes[key].main is not None:
            arrangement.nodes[key].fit_sum()
    arrangement.stack(c)


def inversions(items: Sequence[str], rank: Mapping[str, int],
               weight: Callable[[str, str], float] = lambda upper, lower: 1.0) -> float:
    """Weighted pairs that stand against their rank."""
    return sum(weight(upper, lower) for k, lower in enumerate(items)
               for upper in items[:k] if rank[upper] > rank[lower])


def _at(sided_pin: SidedPin) -> tuple[str, str]:
    side, (_, port) = sided_pin
    return side, port


def _leads(nodes: Mapping[str, Node],
           channels: list[dict[Pin, Net]]) -> list[list[tuple[Pin, Pin]]]:
    """Main lines by channel: from a port to the first listed block that follows it directly."""
    rank = {key: k for k, key in enumerate(nodes)}
    found: list[list[tuple[Pin, Pin]]] = [[] for _ in channels]
    for c, nets in enumerate(channels):
        for net in nets.values():
            side, start = net.entry
            followers = [pin for pin in net.right if nodes[pin[0]].is_plain]
            starts = nodes[start[0]].is_plain or nodes[start[0]].main is not None
            if side == "left" and starts and followers:
                found[c].append((start, min(followers, key=lambda pin: rank[pin[0]])))
    return found


def _crosses(left: Sequence[float], right: Sequence[float], start: float, end: float) -> bool:
    """Whether a net passes from one side of a line to the other."""
    return ((min(left, default=start) < start and max(right, default=end) > end)
            or (max(left, default=start) > start and min(right, default=end) < end))


def _partners(nodes: Mapping[str, Node], channels: list[dict[Pin, Net]]) -> Partners:
    """Other ends of the net at each pin: {node: {(side, pin): [(side, pin)]}}."""
    found: Partners = {key: {} for key in nodes}
    for nets in channels:
        for net in nets.values():
            pins = [("R", pin) for pin in net.left] + [("L", pin) for pin in net.right]
            for side, pin in pins:
                found[pin[0]][side, pin] = [other for other in pins if other != (side, pin)]
    return found


def _channel_crossings(nets: Sequence[Heights]) -> int:
    spans = [(min(left + right), max(left + right)) for left, right in nets]
    total = 0
    for a in range(len(nets)):
        for b in range(a):
            if spans[a][1] >= spans[b][0] and spans[b][1] >= spans[a][0]:
                total += min(crossings(nets[a], nets[b], spans[a], spans[b]),
                             crossings(nets[b], nets[a], spans[b], spans[a]))
    return total


def crossings(first: Heights, second: Heights, first_span: tuple[float, float],
              second_span: tuple[float, float]) -> int:
    """Crossings of two nets ``(left heights, right heights)`` if the first stands left."""
    return (sum(second_span[0] < y < second_span[1] for y in first[1])
            + sum(first_span[0] < y < first_span[1] for y in second[0]))
