"""One order of blocks and wires, whatever the order in which a diagram lists its blocks.

Blocks nearer to an input stand first.  Of two equally near ones that stands first from which the
wires lead to an earlier output of the diagram; where wires decide nothing, names do.
"""

from clie_blocks.diagrams.drawing.graph import Graph


def canonical(graph: Graph) -> Graph:
    """Return the same blocks and wires, listed by how they are wired."""
    near, back = _distances(graph), {key: k for k, key in enumerate(_causes_first(graph))}
    inner = sorted(back, key=lambda key: (near.get(key, len(back)), back[key]))
    order = _terminals(graph, "input") + inner + _terminals(graph, "output")
    rank = {key: k for k, key in enumerate(order)}
    blocks = {key: graph.blocks[key] for key in order}
    return Graph(graph.name, blocks, sorted(graph.wires, key=lambda wire: (
        rank[wire.source[0]], blocks[wire.source[0]].outputs.index(wire.source[1]),
        rank[wire.target[0]], blocks[wire.target[0]].inputs.index(wire.target[1]))))


def _terminals(graph: Graph, kind: str) -> list[str]:
    return [key for key, block in graph.blocks.items() if block.kind == kind]


def _distances(graph: Graph) -> dict[str, int]:
    """Wires from the nearest input, or from a block that nothing drives."""
    driven: dict[str, set[str]] = {key: set() for key in graph.blocks}
    for wire in graph.wires:
        driven[wire.source[0]].add(wire.target[0])
    reached = {key for key, block in graph.blocks.items() if not block.inputs}
    distance, steps = dict.fromkeys(reached, 0), 0
    while reached:
        steps += 1
        reached = {key for start in reached for key in driven[start]} - set(distance)
        distance |= dict.fromkeys(reached, steps)
    return distance


def _causes_first(graph: Graph) -> list[str]:
    """Blocks in the order in which a walk back from the outputs leaves them."""
    causes = _causes(graph)
    ends = _terminals(graph, "output")
    order: list[str] = []
    seen = {*_terminals(graph, "input"), *ends}
    inner = sorted(set(graph.blocks) - seen)
    for start in [source for end in ends for source in causes[end]] + inner:
        path = [] if start in seen else [(start, iter(causes[start]))]
        seen.add(start)
        while path:  # no recursion: a chain may be longer than Python's stack
            key, left = path[-1]
            cause = next((cause for cause in left if cause not in seen), None)
            if cause is None:
                order.append(path.pop()[0])
            else:
                seen.add(cause)
                path.append((cause, iter(causes[cause])))
    return order


def _causes(graph: Graph) -> dict[str, list[str]]:
    """Blocks that drive each block, in the order of its ports."""
    driver = {wire.target: wire.source[0] for wire in graph.wires}
    return {key: [driver[key, port] for port in block.inputs if (key, port) in driver]
            for key, block in graph.blocks.items()}
