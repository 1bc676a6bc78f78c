"""Columns of the blocks: which wires are feedback, and how far right each block stands."""

from collections.abc import Mapping, Sequence

import numpy as np

from clie_blocks.diagrams.drawing.graph import Block, Graph
from clie_blocks.diagrams.drawing.placing import cheapest_order, shortest

FORWARD, BACK = 2.0, 1.0  # what a column of wire costs


def columns(graph: Graph) -> dict[str, int]:
    """Column of each block, left to right, with few and cheap wires that run back."""
    rank = {key: k for k, key in enumerate(_reading_order(graph))}
    index = {key: k for k, key in enumerate(graph.blocks)}
    pulls, gaps = [], set()
    for wire in graph.wires:
        a, b = wire.source[0], wire.target[0]
        if rank[a] < rank[b]:
            gaps.add((index[a], index[b], 1))
            pulls.append((index[a], index[b], 1, FORWARD))
        elif a != b:
            pulls.append((index[b], index[a], 0, BACK))
    inputs, _ = _terminals(graph)
    gaps |= {(index[a], index[b], 1) for a in inputs for b in graph.blocks if b not in inputs}
    found = shortest(len(index), pulls, sorted(gaps))
    column = {key: int(found[k]) for key, k in index.items()}
    first = min([column[key] for key in graph.blocks if key not in inputs], default=1)
    for key in inputs:
        column[key] = first - 1
    low = min(column.values(), default=0)
    return {key: c - low for key, c in column.items()}


def last_column_outputs(graph: Graph, column: Mapping[str, int]) -> dict[str, int]:
    """Move all output terminals to one column right of everything."""
    _, outputs = _terminals(graph)
    last = 1 + max([c for key, c in column.items() if key not in outputs], default=0)
    return {key: last if key in outputs else c for key, c in column.items()}


def _terminals(graph: Graph) -> list[list[str]]:
    return [[key for key, block in graph.blocks.items() if block.kind == kind]
            for kind in ("input", "output")]


def _reading_order(graph: Graph) -> list[str]:
    """Blocks from cause to effect: terminals outside, the cheapest wires turned back."""
    inputs, outputs = _terminals(graph)
    inner = [key for key in graph.blocks if key not in inputs and key not in outputs]
    return [*inputs, *(inner[k] for k in cheapest_order(_turning_cost(graph, inner))), *outputs]


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
