"""Heights of all nodes: as many straight wires as the orders of the columns allow."""

from clie_blocks.diagrams.drawing.order import gap
from clie_blocks.diagrams.drawing.placing import shortest

LEAD, TURN, NEIGHBOUR = 8.0, 0.3, 0.02
ROUNDS = 3


def heights(arrangement):
    """Height of the middle of each node in grid steps, and how bent the wires are.

    Parameters
    ----------
    arrangement : Arrangement
        Columns and ports in their final order.

    Returns
    -------
    dict of str to int
        Heights downwards by node key; neighbours keep their distance.
    float
        Weight of the wires that are not straight.

    """
    index = {key: k for k, key in enumerate(arrangement.nodes)}
    pulls, gaps, wires = [], [], []
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


def _net_pulls(nodes, leads, index, net):
    """Wishes of one net to be straight across its channel, and to turn back closely."""
    def pull(side_a, a, side_b, b, weight):
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


def _weight(nodes, a, b, alone):
    ends = nodes[a[0]], nodes[b[0]]
    if all(end.is_bend for end in ends):
        return 6.0
    if any(end.is_bend for end in ends):
        return 2.0
    if any(end.is_terminal for end in ends):
        return 1.0
    straight = {None: 3.0, b[1]: 3.0}.get(ends[1].main, 0.3)  # least the side arm of a sum
    return straight * (2.0 if alone else 1.0)
