"""Columns of the blocks: which wires are feedback, and how far right each block stands."""

from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.diagrams.drawing.graph import Block, Graph
from clie_blocks.diagrams.drawing.hints import Hints
from clie_blocks.diagrams.drawing.placing import cheapest_order, shortest

FORWARD, BACK = 2.0, 1.0  # what a column of wire costs
KEPT = 1e6  # price of turning round what a hint holds, above all wires together


def columns(graph: Graph, hints: Hints) -> dict[str, int]:
    """Column of each block, left to right, with few and cheap wires that run back.

    Blocks that a hint holds in one column move as one.
    """
    groups, held = _groups(graph, hints)
    rank = {key: k for k, group in enumerate(_reading_order(graph, groups, held)) for key in group}
    index = {key: k for k, group in enumerate(groups) for key in group}
    pulls, gaps = [], {(a, b, 1) for a, b in held}
    for wire in graph.wires:
        a, b = wire.source[0], wire.target[0]
        if rank[a] < rank[b]:
            gaps.add((index[a], index[b], 1))
            pulls.append((index[a], index[b], 1, FORWARD))
        elif rank[a] > rank[b]:
            pulls.append((index[b], index[a], 0, BACK))
    inputs, _ = _terminals(graph)
    gaps |= {(index[a], index[b], 1) for a in inputs for b in graph.blocks if b not in inputs}
    found = shortest(len(groups), pulls, sorted(gaps))
    column = {key: int(found[k]) for key, k in index.items()}
    first = min([column[key] for key in graph.blocks if key not in inputs], default=1)
    for key in inputs:
        column[key] = first - 1
    low = min(column.values(), default=0)
    return {key: c - low for key, c in column.items()}


def _groups(graph: Graph, hints: Hints) -> tuple[list[list[str]], list[tuple[int, int]]]:
    """Blocks that share a column by a hint, each other block alone; and which groups follow."""
    groups: list[list[str]] = []
    follow: list[tuple[int, int]] = []
    for rank in hints.columns:
        here = sorted({rank[key] for key in graph.blocks if key in rank})
        follow += [(len(groups) + k, len(groups) + k + 1) for k in range(len(here) - 1)]
        groups += [[key for key in graph.blocks if rank.get(key) == place] for place in here]
    taken = {key for group in groups for key in group}
    return groups + [[key] for key in graph.blocks if key not in taken], follow


def last_column_outputs(graph: Graph, column: Mapping[str, int]) -> dict[str, int]:
    """Move all output terminals to one column right of everything."""
    _, outputs = _terminals(graph)
    last = 1 + max([c for key, c in column.items() if key not in outputs], default=0)
    return {key: last if key in outputs else c for key, c in column.items()}


def _terminals(graph: Graph) -> list[list[str]]:
    return [[key for key, block in graph.blocks.items() if block.kind == kind]
            for kind in ("input", "output")]


def _reading_order(graph: Graph, groups: Sequence[Sequence[str]],
                   held: Sequence[tuple[int, int]]) -> list[Sequence[str]]:
    """Groups from cause to effect: terminals outside, the cheapest wires turned back."""
    inputs, outputs = _terminals(graph)
    place = {key: k for k, key in enumerate(graph.blocks)}
    listed = sorted((k for k, group in enumerate(groups) if group[0] not in inputs + outputs),
                    key=lambda k: min(place[key] for key in groups[k]))
    inner = [key for k in listed for key in groups[k]]
    member = np.array([[key in groups[k] for key in inner] for k in listed], float)
    cost = member @ _turning_cost(graph, inner) @ member.T
    for before, after in held:
        cost[listed.index(after), listed.index(before)] += KEPT
    return [[key] for key in inputs] + [
        groups[listed[k]] for k in cheapest_order(cost)] + [[key] for key in outputs]


def _turning_cost(graph: Graph, inner: Sequence[str]) -> np.ndarray:
    """Cost of a block before another: the wires from the second to the first run back."""
    index = {key: k for k, key in enumerate(inner)}
    driven = {wire.target[0] for wire in graph.wires
              if graph.blocks[wire.source[0]].kind == "input"}
    cost = np.zeros((len(inner), len(inner)))
    for wire in graph.wires:
        a, b = wire.source[0], wire.target[0]
        if a in index and b in index and a != b:
            price = _turning_price(graph.blocks[b], wire.target[1], driven)
            known = cost[index[b], index[a]]
            cost[index[b], index[a]] = min(price, known) if known else price
    reordered = np.tri(len(inner), k=-1)  # a hair for every change of the listed order
    return cost + 1e-4 * reordered


def _turning_price(target: Block, port: str, driven: set[str]) -> float:
    """Feedback ends in a minus of a sum, or where the outside enters too."""
    if target.kind == "sum" and target.signs[target.inputs.index(port)] != "+":
        return 0.4
    return 0.6 if target.key in driven else 1.0
