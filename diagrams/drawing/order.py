"""Order of the things in each column and of the ports of each block, for few crossings."""

import random
from statistics import fmean

RESTARTS, SWEEPS = 12, 6
GAP_BLOCKS, GAP_BEND, GAP_BENDS = 4, 3, 2


def gap(a, b):
    """Grid steps between the ends of two neighbours in a column."""
    if a.is_bend and b.is_bend:
        return GAP_BENDS
    return GAP_BEND if a.is_bend or b.is_bend else GAP_BLOCKS


class Arrangement:
    """Columns of node keys with the port orders of their nodes, and how many wires cross."""

    def __init__(self, nodes, column, channels):
        self.nodes, self.channels = nodes, channels
        self.column = column
        self.columns = [[] for _ in range(max(column.values(), default=0) + 1)]
        for key in nodes:
            self.columns[column[key]].append(key)
        self.partners = _partners(nodes, channels)
        self.y = {}
        self.stack()

    def stack(self, only=None):
        """Put the nodes of the columns on top of each other, each column centred."""
        for c in range(len(self.columns)) if only is None else [only]:
            y, previous = 0, None
            for key in self.columns[c]:
                node = self.nodes[key]
                y += node.above + (gap(previous, node) + previous.below if previous else 0)
                self.y[key], previous = y, node
            middle = (y + (previous.below if previous else 0)) / 2
            for key in self.columns[c]:
                self.y[key] -= middle

    def pin_y(self, side, pin):
        """Height of a pin at the left or right ('L', 'R') of its node."""
        return self.y[pin[0]] + self.nodes[pin[0]].offset(side, pin[1])

    def snapshot(self):
        """Orders of columns and ports, to return to."""
        return ([list(keys) for keys in self.columns],
                {key: (list(node.left), list(node.right)) for key, node in self.nodes.items()})

    def restore(self, snapshot):
        """Return to a snapshot."""
        columns, ports = snapshot
        self.columns = [list(keys) for keys in columns]
        for key, (left, right) in ports.items():
            self.nodes[key].left, self.nodes[key].right = list(left), list(right)
            if self.nodes[key].main is not None:
                self.nodes[key].fit_sum()
        self.stack()

    def crossings(self, c):
        """Crossings in channel c when each net has one upright, the better way round."""
        return _channel_crossings([
            ([self.pin_y("R", pin) for pin in net.left],
             [self.pin_y("L", pin) for pin in net.right])
            for net in self.channels[c].values()])

    def cost(self):
        """Crossings, and a little for the height that the wires climb."""
        climb = sum(abs(self.pin_y(*a) - self.pin_y(*b))
                    for pins in self.partners.values() for a, others in pins.items()
                    for b in others)
        return sum(self.crossings(c) for c in range(len(self.channels))) + 0.002 * climb

    def sweep(self, rightwards):
        """Sort each column by the mean height of what its nodes are wired to."""
        count = len(self.columns)
        for c in range(count) if rightwards else range(count - 1, -1, -1):
            near = c - 1 if rightwards else c + 1
            wish = {key: self._wish(key, near) for key in self.columns[c]}
            self.columns[c].sort(key=wish.__getitem__)
            self.stack(c)

    def _wish(self, key, near):
        heights = [self.pin_y(*other) - self.nodes[key].offset(*_at(pin))
                   for pin, others in self.partners[key].items() for other in others
                   if self.column[other[1][0]] in (near, self.column[key])
                   and other[1][0] != key]
        return fmean(heights) if heights else self.y[key]

    def sort_ports(self):
        """Sort the ports of each block by the mean height of their other ends."""
        for key, node in self.nodes.items():
            if not node.sortable:
                continue
            for side, ports in (("L", node.left), ("R", node.right)):
                wish = {port: self._port_wish(key, side, port, k)
                        for k, port in enumerate(ports)}
                ports.sort(key=wish.__getitem__)
            if node.main is not None:
                node.fit_sum()

    def _port_wish(self, key, side, port, place):
        others = self.partners[key].get((side, (key, port)), [])
        heights = [self.pin_y(*other) for other in others]
        return fmean(heights) if heights else self.y[key] + 1e-3 * place


def arrange(arrangement):
    """Find the orders with the fewest crossings; the listed order is tried first and wins ties.

    Parameters
    ----------
    arrangement : Arrangement
        Is left at the best orders found.

    """
    chance = random.Random(0)
    start = arrangement.snapshot()
    best, least = start, float("inf")
    for attempt in range(RESTARTS):
        arrangement.restore(start)
        if attempt:
            for keys in arrangement.columns:
                chance.shuffle(keys)
            arrangement.stack()
        for sweep in range(SWEEPS):
            arrangement.sweep(rightwards=sweep % 2 == 0)
            arrangement.sort_ports()
            cost = arrangement.cost()
            if cost < least - 1e-9:
                best, least = arrangement.snapshot(), cost
    arrangement.restore(best)
    _swap_neighbours(arrangement)
    arrangement.sort_ports()
    if arrangement.cost() > least:
        arrangement.restore(best)


def _swap_neighbours(arrangement):
    """Swap neighbours in a column while that removes crossings."""
    improved = True
    while improved:
        improved = False
        for c, keys in enumerate(arrangement.columns):
            for k in range(len(keys) - 1):
                before = arrangement.crossings(c) + arrangement.crossings(c + 1)
                if not before:
                    break
                keys[k], keys[k + 1] = keys[k + 1], keys[k]
                arrangement.stack(c)
                if arrangement.crossings(c) + arrangement.crossings(c + 1) < before:
                    improved = True
                else:
                    keys[k], keys[k + 1] = keys[k + 1], keys[k]
                    arrangement.stack(c)


def _at(sided_pin):
    side, (_, port) = sided_pin
    return side, port


def _partners(nodes, channels):
    """Other ends of the net at each pin: {node: {(side, pin): [(side, pin)]}}."""
    found = {key: {} for key in nodes}
    for nets in channels:
        for net in nets.values():
            pins = [("R", pin) for pin in net.left] + [("L", pin) for pin in net.right]
            for side, pin in pins:
                found[pin[0]][side, pin] = [other for other in pins if other != (side, pin)]
    return found


def _channel_crossings(nets):
    spans = [(min(left + right), max(left + right)) for left, right in nets]
    total = 0
    for a in range(len(nets)):
        for b in range(a):
            if spans[a][1] >= spans[b][0] and spans[b][1] >= spans[a][0]:
                total += min(crossings(nets[a], nets[b], spans[a], spans[b]),
                             crossings(nets[b], nets[a], spans[b], spans[a]))
    return total


def crossings(first, second, first_span, second_span):
    """Crossings of two nets ``(left heights, right heights)`` if the first stands left."""
    return (sum(second_span[0] < y < second_span[1] for y in first[1])
            + sum(first_span[0] < y < first_span[1] for y in second[0]))
