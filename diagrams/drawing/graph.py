"""Blocks and wires of a diagram, with vector signals merged and sums made visible."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.diagrams.drawing.icons import Icon, icon_of
from clie_blocks.labels import ports

if TYPE_CHECKING:
    import control as ct

Pin = tuple[str, str]  # key of a block, and one of its ports
Owner = int | None  # position of a block in its diagram; None for the diagram's own terminals
End = tuple[Owner, str, str]  # owner, side and port
Row = tuple[Owner, str, str, int]  # one signal: owner, side, port and index in it
Bundles = dict[tuple[Owner, str], dict[tuple[tuple[Owner, str], float], list[tuple[int, int]]]]


@dataclass(frozen=True)
class Block:
    """A thing that is drawn: a block, a sum, a gain, a nested diagram or a terminal."""

    key: str
    name: str
    kind: str  # 'block', 'sum', 'gain', 'diagram', 'input' or 'output'
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    icon: Icon | None = None
    signs: tuple[str, ...] = ()
    inner: Graph | None = None


@dataclass(frozen=True)
class Wire:
    """One connection from an output port to an input port, `width` signals wide."""

    source: Pin
    target: Pin
    width: int


@dataclass
class Graph:
    """A diagram as blocks by key, in the order in which they were listed, and wires."""

    name: str
    blocks: dict[str, Block] = field(default_factory=dict)
    wires: list[Wire] = field(default_factory=list)


def read_graph(diagram: ct.InterconnectedSystem, expand: bool | Collection[str] = False,
               path: str = "") -> Graph:
    """Read a diagram into blocks and wires; `path` is the key prefix of a nested one.

    Nested diagrams are opened all, none, or those whose keys (``'plant'``, ``'plant/motor'``) are
    in `expand`.  A port with several sources gets a sum, a factor other than one a gain, as the
    picture must show them.
    """
    ends = _Ends(diagram)
    split = _split_ports(ends)
    graph = Graph(diagram.name)
    for label in ends.names(None, "in", split):
        _add(graph, Block(f"{path}>{label}", label, "input", outputs=(label,)))
    for k, system in enumerate(diagram.syslist):
        _add(graph, _block(system, ends.names(k, "in", split), ends.names(k, "out", split),
                           f"{path}{ends.keys[k]}", expand))
    for label in ends.names(None, "out", split):
        _add(graph, Block(f"{path}{label}>", label, "output", inputs=(label,)))
    for (owner, port), sources in _bundles(ends, split).items():
        target = f"{path}{ends.key(owner, port, 'out')}", port
        _connect(graph, target, [
            ((f"{path}{ends.key(source, start, 'in')}", start), gain, len(pairs))
            for ((source, start), gain), pairs in sources.items()])
    return graph


class _Ends:
    """All signals of a diagram as (owner, side, port name, index), and the terms that join them.

    The owner is the position of the block; None stands for the diagram's own terminals.
    """

    def __init__(self, diagram: ct.InterconnectedSystem) -> None:
        blocks = list(enumerate(diagram.syslist))
        self.keys = _unique([system.name for system in diagram.syslist])
        self.labels: dict[tuple[Owner, str], list[str]] = {
            (k, "in"): list(s.input_labels) for k, s in blocks}
        self.labels |= {(k, "out"): list(s.output_labels) for k, s in blocks}
        self.labels |= {(None, "in"): list(diagram.input_labels),
                        (None, "out"): list(diagram.output_labels)}
        inputs = self._rows([(k, "in") for k, _ in blocks])
        outputs = self._rows([(k, "out") for k, _ in blocks])
        self.terms: dict[Row, list[tuple[Row, float]]] = {row: [] for row in inputs}
        for i, j in zip(*np.nonzero(diagram.connect_map)):
            self.terms[inputs[i]].append((outputs[j], diagram.connect_map[i, j]))
        sources = self._rows([(None, "in")])
        for i, j in zip(*np.nonzero(diagram.input_map)):
            self.terms[inputs[i]].append((sources[j], diagram.input_map[i, j]))
        seen = outputs + inputs  # a diagram may also show what enters a block
        shown = self._rows([(None, "out")])
        drivers = dict(self.terms)
        self.terms |= {row: [] for row in shown}
        for i, j in zip(*np.nonzero(diagram.output_map)):
            gain = diagram.output_map[i, j]
            found = [(seen[j], 1.0)] if j < len(outputs) else drivers[seen[j]]
            self.terms[shown[i]] += [(source, gain * factor) for source, factor in found]

    def _rows(self, groups: Sequence[tuple[Owner, str]]) -> list[Row]:
        return [(owner, side, base, index) for owner, side in groups
                for base, index in _numbered(self.labels[owner, side])]

    def names(self, owner: Owner, side: str, split: set[End]) -> tuple[str, ...]:
        """Port names of one side, a split vector as its elements."""
        labels = self.labels[owner, side]
        return tuple(dict.fromkeys(
            label if (owner, side, base) in split else base
            for label, (base, _) in zip(labels, _numbered(labels))))

    def port(self, signal: Row, split: set[End]) -> tuple[str, int]:
        """Port that carries a signal, and the index of the signal in it."""
        owner, side, base, index = signal
        if (owner, side, base) not in split:
            return base, index
        labels = self.labels[owner, side]
        return labels[ports(labels)[base][index]], 0

    def key(self, owner: Owner, port: str, terminal: str) -> str:
        """Key of what owns a port: a block, or a terminal of the diagram."""
        if owner is not None:
            return self.keys[owner]
        return f">{port}" if terminal == "in" else f"{port}>"

    def size(self, owner: Owner, side: str, base: str) -> int:
        return len(ports(self.labels[owner, side])[base])


def _unique(names: Sequence[str]) -> list[str]:
    """Names with a number after those that stood before: the algebra of blocks repeats them."""
    return [name if names[:k].count(name) == 0 else f"{name}#{names[:k].count(name) + 1}"
            for k, name in enumerate(names)]


def _numbered(labels: Sequence[str]) -> list[tuple[str, int]]:
    indices = {position: (base, index) for base, positions in ports(labels).items()
              for index, position in enumerate(positions)}
    return [indices[k] for k in range(len(labels))]


def _split_ports(ends: _Ends) -> set[End]:
    """Vectors that some wire carries only in part, or out of order: drawn element by element."""
    split: set[End] = set()
    while True:
        partial: set[End] = set()
        for (owner, port), sources in _bundles(ends, split).items():
            for ((source, source_port), _), pairs in sources.items():
                into, out = (owner, _side(owner, "in"), port), (
                    source, _side(source, "out"), source_port)
                sizes = [ends.size(*end) if _is_base(ends, end, split) else 1
                         for end in (into, out)]
                whole = [(k, k) for k in range(max(sizes))]
                if pairs != whole:
                    partial |= {end for end in (into, out) if _is_base(ends, end, split)}
        if not partial:
            return split
        split |= partial


def _side(owner: Owner, inside: str) -> str:
    """Side of an end: the diagram's own inputs act as outputs and the reverse."""
    return inside if owner is not None else {"in": "out", "out": "in"}[inside]


def _is_base(ends: _Ends, end: End, split: set[End]) -> bool:
    owner, side, name = end
    return end not in split and name in ports(ends.labels[owner, side])


def _bundles(ends: _Ends, split: set[End]) -> Bundles:
    """Group the terms by port: {target: {(source, gain): [(index in target, in source)]}}."""
    bundles: Bundles = {}
    for target, terms in ends.terms.items():
        port, index = ends.port(target, split)
        sources = bundles.setdefault((target[0], port), {})
        for source, gain in terms:
            source_port, source_index = ends.port(source, split)
            sources.setdefault(((source[0], source_port), float(gain)), []).append(
                (index, source_index))
    return bundles


def _block(system: ct.NonlinearIOSystem, inputs: tuple[str, ...], outputs: tuple[str, ...],
           key: str, expand: bool | Collection[str]) -> Block:
    common = {"key": key, "name": system.name, "inputs": inputs, "outputs": outputs}
    if hasattr(system, "syslist"):
        opened = expand is True or (expand is not False and key in expand)
        inner = read_graph(system, expand, f"{key}/") if opened else None
        if inner and {block.name for block in inner.blocks.values()
                      if block.kind in ("input", "output")} == {*inputs, *outputs}:
            return Block(kind="diagram", inner=inner, **common)
        return Block(kind="diagram", **common)
    icon, signs = icon_of(system, inputs, outputs)
    return Block(kind=icon.kind if icon and icon.kind in ("sum", "gain") else "block",
                 icon=icon, signs=signs, **common)


def _connect(graph: Graph, target: Pin, sources: Sequence[tuple[Pin, float, int]]) -> None:
    """Wire the sources to a port, through a sum or a gain where the picture needs one."""
    name = f"{target[0]}.{target[1]}"
    ends = []
    # added first, then by name: the order in which blocks are listed decides nothing
    listed = sorted(sources, key=lambda one: (one[1] < 0, one[0], one[1]))
    for k, (source, gain, width) in enumerate(listed):
        sign, size = np.sign(gain), abs(gain)
        if size != 1 or (sign < 0 and len(sources) == 1):
            factor = gain if len(sources) == 1 else size
            block = _add(graph, Block(f"{name}*{k}", "", "gain", ("u",), ("y",),
                                      Icon("gain", f"${factor:.4g}$")))
            graph.wires.append(Wire(source, (block, "u"), width))
            source, sign = (block, "y"), sign if len(sources) > 1 else 1.0
        ends.append((source, sign, width))
    if len(ends) > 1:
        inputs = tuple(str(k) for k in range(len(ends)))
        block = _add(graph, Block(f"{name}+", "", "sum", inputs, ("y",), Icon("sum", ""),
                                  tuple("+" if sign > 0 else "\u2212" for _, sign, _ in ends)))
        graph.wires += [Wire(source, (block, port), width)
                        for port, (source, _, width) in zip(inputs, ends)]
        ends = [((block, "y"), 1.0, ends[0][2])]
    graph.wires += [Wire(source, target, width) for source, _, width in ends]


def _add(graph: Graph, block: Block) -> str:
    graph.blocks[block.key] = block
    return block.key
