"""Lanes of the uprights in each channel, so that no two wires run over each other."""

import numpy as np

from clie_blocks.diagrams.drawing.order import crossings
from clie_blocks.diagrams.drawing.placing import cheapest_order

STEPS = 200


def lanes_of(arrangement, y):
    """Lane of each net in each channel, left to right; straight nets need none.

    Parameters
    ----------
    arrangement : Arrangement
        Orders and channels.
    y : dict of str to int
        Heights by node; a node moves down where two wires could not pass each other.

    Returns
    -------
    list of dict
        Per channel the lane by net.

    """
    for _ in range(STEPS):
        found = [_channel(arrangement.nodes, nets, y) for nets in arrangement.channels]
        blocked = [(c, pin) for c, (_, pin) in enumerate(found) if pin is not None]
        if not blocked:
            break
        c, pin = blocked[0]
        _lower(arrangement.columns[c], pin[0], y)
    return [lanes for lanes, _ in found]


def pin_heights(nodes, net, y):
    """Heights of the pins of a net at the left and at the right of its channel."""
    return ([y[key] + nodes[key].offset("R", port) for key, port in net.left],
            [y[key] + nodes[key].offset("L", port) for key, port in net.right])


def _channel(nodes, nets, y):
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
    lanes = {}
    for place in cheapest_order(cost):
        name = bent[place]
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


def _lower(keys, key, y):
    for below in keys[keys.index(key):]:
        y[below] += 1
