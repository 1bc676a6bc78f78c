"""From nested diagrams to leaf blocks and wire sums."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from graphlib import CycleError, TopologicalSorter
from typing import Any

import control as ct
import numpy as np

from clie_blocks.labels import DiagramError

Wire = dict[tuple[str, int], float]  # gain by source, see `Flat`


@dataclass(frozen=True)
class Leaf:
    """One block that is not a diagram, at its position in the flat vectors.

    Parameters
    ----------
    system : control.NonlinearIOSystem
        The block.
    name : str
        Its path, such as ``'plant.coulomb'``.
    x, u, y : int
        Where its states, inputs and outputs begin.
    params : dict
        The parameter values that python-control would give it.

    """

    system: ct.NonlinearIOSystem
    name: str
    x: int
    u: int
    y: int
    params: dict[str, Any]


@dataclass
class Flat:
    """A diagram without nesting.

    A wire sum is a dict from ``('y', k)``, a leaf output, ``('u', k)``, a diagram input, or
    ``('h', k)``, a held output of the diagram's blocks, to its gain.

    Parameters
    ----------
    leaves : list of Leaf
        In the order of their states in the diagram.
    wires : list of dict
        The wire sum of every leaf input.
    outputs : list of dict
        The wire sum of every diagram output.
    signals : dict
        The wire sum of every port of every block and nested diagram, by ``'block.port'``.

    """

    leaves: list[Leaf]
    wires: list[Wire]
    outputs: list[Wire]
    signals: dict[str, Wire]


def flatten(diagram: ct.NonlinearIOSystem, held: Iterable[int] = ()) -> Flat:
    """Return the leaves and wires of a diagram.

    Raises
    ------
    DiagramError
        If wires of nested diagrams close a loop without any block in it.

    """
    parts = _Parts()
    top: list[Wire] = [{("u", k): 1.0} for k in range(diagram.ninputs)]
    show = _Visit(parts, diagram, lambda k: top[k], "", dict(diagram.params or {}),
                  frozenset(held)).show
    return Flat(parts.leaves, [wire() for wire in parts.wires],
                [show(k) for k in range(diagram.noutputs)],
                {name: wire() for name, wire in parts.signals.items()})


@dataclass
class _Parts:
    """Leaves seen so far, and their wires, which are followed once all leaves are known."""

    leaves: list[Leaf] = field(default_factory=list)
    wires: list[Callable[[], Wire]] = field(default_factory=list)
    signals: dict[str, Callable[[], Wire]] = field(default_factory=dict)


class _Visit:
    """One system in the tree of diagrams; `drive(k)` returns the wire sum of its input k."""

    def __init__(self, parts: _Parts, system: ct.NonlinearIOSystem, drive: Callable[[int], Wire],
                 path: str, params: dict[str, Any], held: frozenset[int] = frozenset()) -> None:
        self.system, self.drive, self.path, self.held = system, drive, path, held
        self.busy: set[int] = set()
        if isinstance(system, ct.InterconnectedSystem):
            self.parts = [
                _Visit(parts, part, self._driver(k), f"{path}.{part.name}" if path else part.name,
                       {**(part.params or {}), **params})
                for k, part in enumerate(system.syslist)]
            self.show = self._show_diagram
        else:
            self._add_leaf(parts, params)
        if path:
            self._name_ports(parts)

    def _add_leaf(self, parts: _Parts, params: dict[str, Any]) -> None:
        x = u = y = 0
        if parts.leaves:
            last = parts.leaves[-1]
            x, u, y = (last.x + last.system.nstates, last.u + last.system.ninputs,
                       last.y + last.system.noutputs)
        parts.leaves.append(Leaf(self.system, self.path or self.system.name, x, u, y, params))
        parts.wires += [partial(self.drive, k) for k in range(self.system.ninputs)]
        self.show = lambda k: {("y", y + k): 1.0}

    def _name_ports(self, parts: _Parts) -> None:
        for k, label in enumerate(self.system.input_labels):
            parts.signals[f"{self.path}.{label}"] = partial(self.drive, k)
        for k, label in enumerate(self.system.output_labels):
            parts.signals[f"{self.path}.{label}"] = partial(self.show, k)

    def _driver(self, part: int) -> Callable[[int], Wire]:
        return lambda k: self._input(self.system.input_offset[part] + k)

    def _input(self, row: int) -> Wire:
        if row in self.busy:
            raise DiagramError(f"{self.system.name}: the wires into input {row} form a loop "
                               "without a block; remove one of them")
        self.busy.add(row)
        try:
            terms = [(self.system.connect_map[row, k], self._output(k))
                     for k in np.flatnonzero(self.system.connect_map[row])]
            terms += [(self.system.input_map[row, k], self.drive(int(k)))
                      for k in np.flatnonzero(self.system.input_map[row])]
        finally:
            self.busy.discard(row)
        return _sum(terms)

    def _output(self, column: int | np.integer) -> Wire:
        if column in self.held:
            return {("h", int(column)): 1.0}
        for k, part in enumerate(self.system.syslist):
            local = column - self.system.output_offset[k]
            if 0 <= local < part.noutputs:
                return self.parts[k].show(int(local))
        return self._input(int(column) - sum(part.noutputs for part in self.system.syslist))

    def _show_diagram(self, k: int) -> Wire:
        row = self.system.output_map[k]
        return _sum([(row[column], self._output(column)) for column in np.flatnonzero(row)])


def _sum(terms: Iterable[tuple[float, Wire]]) -> Wire:
    total: Wire = {}
    for gain, wire in terms:
        for source, inner in wire.items():
            total[source] = total.get(source, 0.0) + float(gain) * inner
    return total


def schedule(needs: Mapping[int, set[int]], names: Mapping[int, str]) -> list[int]:
    """Return all output signals, each after those that it needs at the same instant.

    Raises
    ------
    DiagramError
        If signals depend on each other at once; the message names them around the loop.

    """
    try:
        return list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        path = " -> ".join(names[signal] for signal in error.args[1])
        raise DiagramError(
            f"algebraic loop: {path}. Each of these signals needs the other at the same instant; "
            "break the loop with a block that has a state, such as a filter or a delay") from None
