"""Course of the wires: heights of the nodes, drops onto sums, lanes of the uprights.

As many wires are straight as the orders of the columns allow; no two run over each other.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.diagrams.drawing.channels import Net
from clie_blocks.diagrams.drawing.graph import Pin
from clie_blocks.diagrams.drawing.order import Arrangement, Heights, crossings, gap
from clie_blocks.diagrams.drawing.placing import cheapest_order, shortest
from clie_blocks.diagrams.drawing.shapes import Node

LEAD, TURN, NEIGHBOUR = 12.0, 0.3, 0.02
ROUNDS = 3
STEPS = 200


def heights(arrangement: Arrangement) -> tuple[dict[str, float], float]:
    """Heights of the nodes in whole grid steps, downwards, and how bent the wires are.

    Neighbours keep their distance; the second value is the weight of the wires that are not
    straight.
    """
    index = {key: k for k, key in enumerate(arrangement.nodes)}
    pulls: list[tuple[int, int, float, float]] = []
    gaps: list[tuple[int, int, float]] = []
    wires: list[tuple[int, int, float, float]] = []
    for keys in arrangement.columns:
        for a, b in zip(keys, keys[1:]):
            upper, lower = arrangement.nodes[a], arrangement.nodes[b]
            distance = upper.below + gap(upper, lower) + lower.above
            gaps.append((index[a], index[b], distance))
            pulls.append((index[a], index[b], distance, NEIGHBOUR))
    for nets, leads in zip(arrangement.channels, arrangement.leads):
        for net in nets.values():
            wires += _net_pulls(arrangement.nodes, leads, index, net)
    pulls += wires
    weights = [weight for *_, weight in pulls]
    for _ in range(ROUNDS):
        found = shortest(len(index), [(*pull[:3], weight) for pull, weight in zip(pulls, weights)],
                         gaps)
        # a wire that is bent anyway gives way to one that is nearly straight
        weights = [weight / (1 + abs(found[b] - found[a] - d)) for a, b, d, weight in pulls]
    bent = sum(weight for a, b, d, weight in wires if found[b] - found[a] != d)
    return {key: int(found[k]) for key, k in index.items()}, bent


def _net_pulls(nodes: Mapping[str, Node], leads: Sequence[tuple[Pin, Pin]],
               index: Mapping[str, int], net: Net) -> list[tuple[int, int, float, float]]:
    """Wishes of one net to be straight across its channel, and to turn back closely."""
    def pull(side_a: str, a: Pin, side_b: str, b: Pin,
             weight: float) -> tuple[int, int, float, float]:
        distance = nodes[a[0]].offset(side_a, a[1]) - nodes[b[0]].offset(side_b, b[1])
        return index[a[0]], index[b[0]], distance, weight

    side, entry = net.entry
    exits = [(other, pin) for other, pins in (("left", net.left), ("right", net.right))
             for pin in pins if pin != entry and pin[0] != entry[0]]
    face = {"left": "R", "right": "L"}
    return [pull(face[side], entry, face[other], pin,
                 TURN if other == side else
                 LEAD if (entry, pin) in leads else _weight(nodes, entry, pin, len(exits) == 1))
            for other, pin in exits]


def _weight(nodes: Mapping[str, Node], a: Pin, b: Pin, alone: bool) -> float:
    ends = nodes[a[0]], nodes[b[0]]
    if all(end.is_bend for end in ends):
        return 6.0
    if any(end.is_bend for end in ends):
        return 2.0
    if any(end.is_terminal for end in ends):
        return 1.0
    straight = {None: 3.0, b[1]: 3.0}.get(ends[1].main, 0.3)  # least the side arm of a sum
    return straight * (2.0 if alone else 1.0)


def take_drops(arrangement: Arrangement) -> dict[str, Pin]:
    """Let a wire that passes next to a sum drop straight onto it.

    Returns port and key of the sum by the key of the bend from which the wire drops; the pins of
    the drops leave the channels of the arrangement.
    """
    drops: dict[str, Pin] = {}
    for c, keys in enumerate(arrangement.columns):
        for upper, lower in zip(keys, keys[1:]):
            for key, bend, side in ((upper, lower, -1), (lower, upper, 0)):
                node = arrangement.nodes[key]
                if node.main is None or not arrangement.nodes[bend].is_bend:
                    continue
                port = node.left[side]
                facing = node.offset("L", port) * (1 if side else -1) > 0
                name = _joined(arrangement.channels[c], (key, port), (bend, "~"))
                if facing and name is not None and bend not in drops:
                    _leave(arrangement.channels[c], name, (key, port))
                    drops[bend] = port, key
    return drops


def _joined(nets: Mapping[Pin, Net], *pins: Pin) -> Pin | None:
    return next((name for name, net in nets.items() if all(p in net.right for p in pins)), None)


def _leave(nets: dict[Pin, Net], name: Pin, pin: Pin) -> None:
    nets[name].right.remove(pin)
    if len(nets[name].left) + len(nets[name].right) == 1:
        del nets[name]


def lanes_of(arrangement: Arrangement, y: dict[str, float]) -> list[dict[Pin, int]]:
    """Lane of each net in each channel, left to right; straight nets need none.

    A node moves down (in `y`) where two wires could not pass each other.
    """
    for _ in range(STEPS):
        found = [_channel(arrangement.nodes, nets, y) for nets in arrangement.channels]
        blocked = [(c, pin) for c, (_, pin) in enumerate(found) if pin is not None]
        if not blocked:
            break
        c, pin = blocked[0]
        _lower(arrangement.columns[c], pin[0], y)
    return [lanes for lanes, _ in found]


def pin_heights(nodes: Mapping[str, Node], net: Net, y: Mapping[str, float]) -> Heights:
    """Heights of the pins of a net at the left and at the right of its channel."""
    return ([y[key] + nodes[key].offset("R", port) for key, port in net.left],
            [y[key] + nodes[key].offset("L", port) for key, port in net.right])


def _channel(nodes: Mapping[str, Node], nets: Mapping[Pin, Net],
             y: Mapping[str, float]) -> tuple[dict[Pin, int], Pin | None]:
    """Lanes of one channel, and a pin that must move if two nets block each other."""
    pins = {name: pin_heights(nodes, net, y) for name, net in nets.items()}
    spans = {name: (min(left + right), max(left + right))
             for name, (left, right) in pins.items()}
    bent = [name for name in nets if spans[name][0] < spans[name][1]]
    cost = np.zeros((len(bent), len(bent)))
    for i, a in enumerate(bent):
        for j, b in enumerate(bent):
            if i != j:
                cost[i, j] = (crossings(pins[a], pins[b], spans[a], spans[b])
                              + 1000 * bool(set(pins[a][1]) & set(pins[b][0])))
    lanes: dict[Pin, int] = {}
    for k in cheapest_order(cost):
        name = bent[k]
        shared = [lane for other, lane in lanes.items()
                  if spans[other][0] <= spans[name][1] + 1
                  and spans[name][0] <= spans[other][1] + 1]
        for other in lanes:
            level = set(pins[other][1]) & set(pins[name][0])
            if level:
                key = nets[other].right[pins[other][1].index(min(level))]
                return lanes, key
        lanes[name] = 1 + max(shared, default=-1)
    return lanes, None


def _lower(keys: list[str], key: str, y: dict[str, float]) -> None:
    for below in keys[keys.index(key):]:
        y[below] += 1
