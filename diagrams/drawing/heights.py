"""Heights of all nodes: as many straight wires as the orders of the columns allow."""

from clie_blocks.diagrams.drawing.order import gap
from clie_blocks.diagrams.drawing.placing import shortest

TURN, NEIGHBOUR = 0.3, 0.02


def heights(arrangement):
    """Height of the middle of each node in grid steps, by key.

    Parameters
    ----------
    arrangement : Arrangement
        Columns and ports in their final order.

    Returns
    -------
    dict of str to int
        Heights downwards; neighbours keep their distance.

    """
    index = {key: k for k, key in enumerate(arrangement.nodes)}
    pulls, gaps = [], []
    for keys in arrangement.columns:
        for a, b in zip(keys, keys[1:]):
            upper, lower = arrangement.nodes[a], arrangement.nodes[b]
            distance = upper.below + gap(upper, lower) + lower.above
            gaps.append((index[a], index[b], distance))
            pulls.append((index[a], index[b], distance, NEIGHBOUR))
    for nets in arrangement.channels:
        for net in nets.values():
            pulls += _net_pulls(arrangement.nodes, index, net)
    found = shortest(len(index), pulls, gaps)
    return {key: int(found[k]) for key, k in index.items()}


def _net_pulls(nodes, index, net):
    """Wishes of one net to be straight across its channel, and to turn back closely."""
    def pull(side_a, a, side_b, b, weight):
        distance = nodes[a[0]].offset(side_a, a[1]) - nodes[b[0]].offset(side_b, b[1])
        return index[a[0]], index[b[0]], distance, weight

    alone = len(net.left) == len(net.right) == 1
    found = [pull("R", a, "L", b, _weight(nodes, a, b, alone))
             for a in net.left for b in net.right if a[0] != b[0]]
    for side, pins in (("R", net.left), ("L", net.right)):
        found += [pull(side, a, side, b, TURN) for a, b in zip(pins, pins[1:]) if a[0] != b[0]]
    return found


def _weight(nodes, a, b, alone):
    bends = nodes[a[0]].is_bend + nodes[b[0]].is_bend
    if bends == 2:
        return 6.0
    if bends == 1:
        return 2.0
    straight = 2.0 if nodes[b[0]].main in (None, b[1]) else 0.3  # not the side arm of a sum
    return straight * (3.0 if alone else 1.0)
