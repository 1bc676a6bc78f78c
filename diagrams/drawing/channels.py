"""What meets between two columns: the ends of each net, with bends for wires that go further.

Channel c lies left of column c.  A wire that runs back leaves to the right, turns, passes its
columns as bends and turns again before its target.
"""

from dataclasses import dataclass, field

from clie_blocks.diagrams.drawing.shapes import Node


@dataclass
class Net:
    """Ends of one net in one channel: pins ``(node, port)`` at its left and at its right.

    `entry` is the side and pin through which the signal comes.
    """

    left: list = field(default_factory=list)
    right: list = field(default_factory=list)
    entry: tuple = ()

    def add(self, side, pin):
        """Add a pin; the first one is the entry."""
        self.entry = self.entry or (side, pin)
        pins = self.left if side == "left" else self.right
        if pin not in pins:
            pins.append(pin)


def channels_of(graph, nodes, column):
    """Nets of every channel; adds the bends to `nodes` and `column`.

    Parameters
    ----------
    graph : Graph
        Blocks and wires.
    nodes : dict of str to Node
        Nodes by key; bends are added.
    column : dict of str to int
        Column by key; bends are added.

    Returns
    -------
    list of dict
        Per channel the `Net` by source pin ``(block, port)``.

    """
    count = max(column.values(), default=0) + 2
    channels = [{} for _ in range(count)]

    def meet(c, net, side, pin):
        channels[c].setdefault(net, Net()).add(side, pin)

    def bend(net, c):
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


def take_drops(arrangement):
    """Let a wire that passes next to a sum drop straight onto it; returns the drops.

    Parameters
    ----------
    arrangement : Arrangement
        In its final order; the pins of the drops leave its channels.

    Returns
    -------
    dict
        Port and key of the sum, by the key of the bend from which the wire drops.

    """
    found = {}
    for c, keys in enumerate(arrangement.columns):
        for upper, lower in zip(keys, keys[1:]):
            for key, bend, side in ((upper, lower, -1), (lower, upper, 0)):
                node = arrangement.nodes[key]
                if node.main is None or not arrangement.nodes[bend].is_bend:
                    continue
                port = node.left[side]
                facing = node.offset("L", port) * (1 if side else -1) > 0
                name = _joined(arrangement.channels[c], (key, port), (bend, "~"))
                if facing and name is not None and bend not in found:
                    _leave(arrangement.channels[c], name, (key, port))
                    found[bend] = port, key
    return found


def _joined(nets, *pins):
    return next((name for name, net in nets.items() if all(p in net.right for p in pins)), None)


def _leave(nets, name, pin):
    nets[name].right.remove(pin)
    if len(nets[name].left) + len(nets[name].right) == 1:
        del nets[name]
